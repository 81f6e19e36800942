"""The tube with fins of chapter 4, which paddles: two curved fins on the sides of a tube that is pinched."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.materials import Frozen, Material, material
from lab.units import Quantity

Array = NDArray[np.float64]
#: Density of fibreglass, kg/m^3: tells from mass and size of a load fin how thick a sheet it is.
_FIBREGLASS = 1850.0
_MM = 1e3


class Chambers(Frozen):
    """Pneumatic chambers on both sides of the tube's inside, about +y and -y (fig. 4.2b, table 4.1).

    ASSUMED, since the text has no drawing: the chambers of a side stand beside one another *around* the tube, each
    with its ``length`` along the axis.  Nine of 5 mm take 45 mm of the 74 mm that half the inner circumference has,
    the 50 mm of the tube's length would hold them hardly; and chambers that push one another apart stretch the inside
    of the wall around, which straightens its curvature and so flattens the tube, as the text says of them.  All sizes
    are those of the outside; the cavity is smaller by the walls, and its floor is the tube's wall.  The gap between
    the tops of neighbours is not published, nor is the way that the air takes between them, which is left out.
    """

    number: int = Field(9, ge=0, le=40, description="n, of each side; 0: none.")
    width: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="w, around.")] = 0.005
    height: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="h, inwards.")] = 0.005
    length: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="l, along the tube.")] = 0.014
    wall: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="t1.")] = 0.0004
    gap: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Between the tops of neighbours.")] = 0.0005

    @model_validator(mode="after")
    def _has_cavities(self) -> "Chambers":
        least = min(self.width / 2, self.height, self.length / 2)
        if self.wall >= least:
            raise ValueError(
                f"chambers: a wall of {_MM * self.wall:g} mm leaves no cavity; needed: less than {_MM * least:.3g} mm"
            )
        return self

    def pitch(self, inside: float) -> float:
        """Angle between neighbours, rad, in a tube of the inner radius ``inside``, m."""
        top = inside - self.height
        return float(2 * np.arctan2(self.width / 2, top) + self.gap / np.hypot(top, self.width / 2))

    def angles(self, inside: float) -> Array:
        """Angle of every chamber of the side about +y from +x, rad (number,)."""
        places = np.arange(self.number, dtype=float) - (self.number - 1) / 2
        return np.asarray(np.pi / 2 + self.pitch(inside) * places, dtype=np.float64)


class LoadFin(Frozen):
    """Flat stiff extension of each fin's tip (fig. 4.6b).

    Only the mass is published, and that it is of fibreglass: rigid beside the fin.  The text's Reynolds numbers imply
    a chord of 83.7 mm with it and of 52.8 mm without, hence ``length``.  ASSUMED: the ``width``, with which the mass
    is that of a sheet of 0.8 mm; and that the published mass is that of one of the two.
    """

    mass: Annotated[float, Quantity("kg", "g"), Field(gt=0, description="Of one load fin.")] = 0.00205
    length: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Beyond the fin's tip.")] = 0.0309
    width: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Across, along y.")] = 0.045

    @property
    def sheet(self) -> float:
        """Thickness of a fibreglass sheet of this mass and size, m."""
        return self.mass / (_FIBREGLASS * self.length * self.width)

    @model_validator(mode="after")
    def _is_a_sheet(self) -> "LoadFin":
        if not 5e-5 <= self.sheet <= 5e-3:
            raise ValueError(
                f"load fin of {_MM * self.mass:g} g on {_MM * self.length:g} x {_MM * self.width:g} mm: fibreglass "
                f"would be {_MM * self.sheet:.2g} mm thick; between 0.05 and 5 mm is a stiff sheet"
            )
        return self


class FinnedTube(Frozen):
    """Circular tube with a curved fin on each side (fig. 4.2, table 4.1).

    The axis is z from 0 to ``length``; the tube is pinched along y, the fins lie to +x and -x, mirror images in x = 0.

    A fin is an arc of ``fin_arc`` about the x-z plane on a cylinder whose middle radius is the tube's ("the initial
    radius of curvature of the tube and fin are set equal") and whose axis crosses the tube's in the x-z plane at
    ``attachment_angle``.  With psi the angle around that axis and s the place along it, the fin's middle surface is

        c + Rm (cos psi n + sin psi e_y) + s a,   a = (sin theta, 0, cos theta),   n = (cos theta, 0, -sin theta)

    Equal cylinders with crossing axes meet in plane arcs of ellipses: the crease of the two middle surfaces lies in
    the plane of e_y and (cos(theta/2), 0, -sin(theta/2)).  The fin ends where its two faces meet the tube's outside.
    The concave side of the fin looks towards +z and the tube's axis.  At 90 deg it stands straight out.

    ASSUMED, since the text has no drawing: this reading of theta; that the diameter is that of the outside; that the
    middle of the crease lies at mid-length (``fin_place``); and the fin's length along its crown, which is the mean
    chord that the text's Reynolds numbers imply (Re 1014 at 19.2 mm/s in water of 1e-6 m^2/s), with a tip cut across
    its generators.
    """

    kind: Literal["FinnedTube"] = "FinnedTube"
    diameter: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="D, of the outside.")] = 0.050
    length: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="L, of the tube.")] = 0.050
    wall: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="t2.")] = 0.0015
    fin_thickness: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="tf.")] = 0.002
    fin_arc: Annotated[float, Quantity("rad", "deg"), Field(gt=0, description="alpha.")] = float(np.deg2rad(65.0))
    attachment_angle: Annotated[float, Quantity("rad", "deg"), Field(gt=0, description="theta.")] = float(
        np.deg2rad(60.0)
    )
    fin_length: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="From crease to tip, crown.")] = 0.0528
    #: z where the middle of the crease lies; None: at mid-length.
    fin_place: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None
    chambers: Chambers = Chambers()
    load_fin: LoadFin | None = None
    material: Material = Field(default_factory=lambda: material("tpe-92a"))

    @model_validator(mode="after")
    def _fits_together(self) -> "FinnedTube":
        self._check_walls()
        self._check_root()
        self._check_chambers()
        return self

    def _check_walls(self) -> None:
        for name, thickness in (("wall", self.wall), ("fin_thickness", self.fin_thickness)):
            if thickness > self.radius / 5:
                raise ValueError(
                    f"{name} {_MM * thickness:g} mm is too thick for diameter {_MM * self.diameter:g} mm: at most a "
                    "tenth of it, beyond which it is no thin tube"
                )
        if not 20.0 <= (angle := round(float(np.rad2deg(self.attachment_angle)), 9)) <= 120.0:
            raise ValueError(
                f"attachment_angle {angle:g} deg must lie between 20 and 120 deg: a fin that lies flatter on the tube "
                "has no crease that bends"
            )

    def _check_root(self) -> None:
        half, outer = self.fin_arc / 2, self.mid_radius + self.fin_thickness / 2
        # Up to 80 deg around the tube, so that the two fins keep clear of one another and of the pinch.
        most = 2 * np.arcsin(min(self.radius * np.sin(np.deg2rad(80.0)) / outer, 1.0))
        least = 2 * self.fin_thickness / self.mid_radius
        if not least <= self.fin_arc <= most:
            raise ValueError(
                f"fin_arc {np.rad2deg(self.fin_arc):.4g} deg must lie between {np.rad2deg(least):.3g} deg, twice its "
                f"thickness, and {np.rad2deg(most):.4g} deg, up to which both faces meet this side of the tube"
            )
        psi = np.linspace(0.0, half, 41)
        faces = [self.face_radius(depth) for depth in (0.0, 1.0)]
        heights = np.concatenate([self.root(psi, radius)[:, 2] for radius in faces])
        margin = 2 * self.wall
        if heights.min() < margin or heights.max() > self.length - margin:
            raise ValueError(
                f"the crease runs from z = {_MM * heights.min():.3g} to {_MM * heights.max():.3g} mm, and must stay "
                f"{_MM * margin:g} mm within the tube of {_MM * self.length:g} mm: move fin_place or narrow fin_arc"
            )
        needed = max(float(self.root_along(psi, radius).max()) for radius in faces) - self.crown_along
        if self.fin_length < needed + 2 * self.fin_thickness:
            raise ValueError(
                f"fin_length {_MM * self.fin_length:g} mm is shorter than its root needs: more than "
                f"{_MM * (needed + 2 * self.fin_thickness):.3g} mm"
            )

    def _check_chambers(self) -> None:
        chambers, inside = self.chambers, self.inner_radius
        if not chambers.number:
            return
        if chambers.height > 0.6 * inside:
            raise ValueError(
                f"chambers of height {_MM * chambers.height:g} mm leave too little of the inner radius, "
                f"{_MM * inside:g} mm: at most {_MM * 0.6 * inside:.3g} mm"
            )
        if chambers.length > self.length:
            raise ValueError(
                f"chambers of length {_MM * chambers.length:g} mm are longer than the tube, {_MM * self.length:g} mm"
            )
        if (span := chambers.number * chambers.pitch(inside)) > np.pi:
            raise ValueError(
                f"{chambers.number} chambers on each side take {np.rad2deg(span):.4g} of the 180 deg inside the tube: "
                "make them fewer, narrower or lower"
            )

    @property
    def radius(self) -> float:
        """Of the outside, m."""
        return self.diameter / 2

    @property
    def inner_radius(self) -> float:
        """Of the inside, m."""
        return self.radius - self.wall

    @property
    def mid_radius(self) -> float:
        """Of the middle of the tube's wall, and of the fin's, m."""
        return self.radius - self.wall / 2

    @property
    def place(self) -> float:
        """z of the middle of the crease on the tube's middle surface, m."""
        return self.length / 2 if self.fin_place is None else self.fin_place

    @property
    def fin_axis(self) -> Array:
        """a, unit vector along the generators of the fin at +x, outwards (3,)."""
        return np.array([np.sin(self.attachment_angle), 0.0, np.cos(self.attachment_angle)])

    @property
    def fin_normal(self) -> Array:
        """n, unit outward normal of the crown of the fin at +x, on its convex side (3,)."""
        return np.array([np.cos(self.attachment_angle), 0.0, -np.sin(self.attachment_angle)])

    @property
    def fin_centre(self) -> Array:
        """c, where the fin's axis crosses the tube's, m (3,)."""
        return np.array([0.0, 0.0, self.place + self.mid_radius * np.tan(self.attachment_angle / 2)])

    @property
    def crown_along(self) -> float:
        """s of the middle of the crease on the middle surfaces, m."""
        return float(self.mid_radius * np.tan(self.attachment_angle / 2))

    @property
    def tip_along(self) -> float:
        """s of the tip, m."""
        return self.crown_along + self.fin_length

    @property
    def tip_corner(self) -> Array:
        """P, where the tip's edge at psi = +alpha/2 meets the middle surface of the fin at +x, m (3,).

        ASSUMED: fig. 4.2(a) is not in the text, and P must move along y as the fin's curvature grows.
        """
        return self.fin_places(np.array([self.fin_arc / 2]), np.array([self.tip_along]))[0]

    @property
    def root_middle(self) -> Array:
        """Middle of the crease on the middle surfaces, m (3,)."""
        return np.array([self.mid_radius, 0.0, self.place])

    def face_radius(self, depth: float) -> float:
        """Distance from the fin's axis, m: ``depth`` 0 of its concave face, 1/2 of its middle, 1 of its convex face."""
        return self.mid_radius + (depth - 0.5) * self.fin_thickness

    def fin_places(self, psi: Array, s: Array, radius: float | Array | None = None) -> Array:
        """Positions (n, 3), m, in the fin at +x.

        Parameters
        ----------
        psi, s
            Angle around the fin's axis, rad (n,), and place along it, m (n,).
        radius
            Distance from the fin's axis, m; None: of its middle surface.
        """
        distance = self.mid_radius if radius is None else radius
        across = np.outer(np.cos(psi), self.fin_normal) + np.outer(np.sin(psi), [0.0, 1.0, 0.0])
        return self.fin_centre + across * np.reshape(distance, (-1, 1)) + np.outer(s, self.fin_axis)

    def root_along(self, psi: Array, radius: float) -> Array:
        """s (n,), m, where the fin's cylinder of ``radius``, m, meets the tube's outside; psi as in ``fin_places``."""
        sine, cosine = np.sin(self.attachment_angle), np.cos(self.attachment_angle)
        return (np.sqrt(self.radius**2 - (radius * np.sin(psi)) ** 2) - radius * np.cos(psi) * cosine) / sine

    def root(self, psi: Array, radius: float) -> Array:
        """Positions (n, 3), m, of that curve."""
        return self.fin_places(psi, self.root_along(psi, radius), radius)

    def geometry(self) -> dict[str, Any]:
        """The fields that a mesh depends on, SI; of the chambers it is their length, up to which tubes are pinched."""
        return self.model_dump(exclude={"kind", "material", "load_fin"})
