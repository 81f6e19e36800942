"""What the fins do while the tube between them is flattened (4.4)."""

from typing import ClassVar, Literal

import numpy as np

from lab.experiments.fin_drive import FinDrive
from lab.records import Record, Scalar


class ShapePropagation(FinDrive):
    """A free tube with fins is pinched along y, or its chambers are inflated.

    Sensed at every increment, rest first (index ``increment``):

    ``travel`` (n,), approach of top and bottom at mid-length, m; ``force`` (n,), on one side, of the whole device, N;
    ``pressure`` (n,), in the chambers, Pa; ``p`` (n, 3), displacement of P, the tip's corner at +y of the fin at +x,
    m, the tube's middle being held against rigid motions; ``fin_y`` (n,), largest motion of the fin's half at y > 0
    towards the x-z plane, m; ``section`` (n, m, 2), x and y of the middle of the wall at mid-length, in order, m;
    ``fin_radius`` (n,), of the circle that fits the middle line of the tip's edge, m; ``fin_angle`` (n,), of the
    fin's crown from +z towards +x, rad; ``gap`` (n,), smallest between inner walls, m; ``energy`` (n,), elastic, J;
    ``strain`` (n,), largest principal strain.

    With the drive pressure ``travel`` is the answer, up to the pressure of the last increment, and need not grow with
    it: where chambers meet across y = 0, more air may push top and bottom apart again.
    """

    kind: Literal["ShapePropagation"] = "ShapePropagation"
    in_motion: ClassVar[bool] = False

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Travel of P and what the fin does until the last state that was reached.

        ``s`` is the distance of P from its place at rest in x-z; ``y`` is how far it has come towards the x-z plane,
        so that it grows with the fin's curvature, as the text has it.
        """
        p, angle, radius, force = (record[name] for name in ("p", "fin_angle", "fin_radius", "force"))
        travel = record["travel"]
        at = f"at the travel of {1e3 * float(travel[-1]):.4g} mm"
        stroke = float(angle[0] - angle[-1])
        largest = float(record["fin_y"][-1]) if "fin_y" in record.channels else float("nan")
        return {
            "s": Scalar(float(np.hypot(p[-1, 0], p[-1, 2])), "m", f"distance of P from rest in x-z {at}"),
            "y": Scalar(float(-p[-1, 1]), "m", f"motion of P along y towards the x-z plane {at}"),
            "y_fin": Scalar(largest, "m", f"largest motion of the fin along y towards the x-z plane {at}"),
            "p_x": Scalar(float(p[-1, 0]), "m", f"displacement of P along x {at}"),
            "p_z": Scalar(float(p[-1, 2]), "m", f"displacement of P along z {at}"),
            "travel_reached": Scalar(float(travel[-1]), "m", "approach of top and bottom in the last state"),
            "stroke": Scalar(stroke, "rad", f"turn of the fin's crown towards the tube {at}"),
            "transmission": Scalar(
                float(np.hypot(p[-1, 0], p[-1, 2]) / travel[-1]) if travel[-1] else float("nan"), "1", "s over travel"
            ),
            "curvature_gain": Scalar(
                float(radius[0] / radius[-1]), "1", f"curvature of the tip over that at rest {at}"
            ),
            "force_max": Scalar(float(np.nanmax(force)), "N", "largest force of the pinch on one side"),
            "work": Scalar(float(np.trapezoid(force, travel)), "J", "of the pinching forces"),
            "largest_strain": Scalar(float(np.nanmax(record["strain"])), "1", "largest principal strain"),
        }
