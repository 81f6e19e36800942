"""Stage ``report``: one HTML file for readers."""

import json

from lab.experiments import BaseShake, Experiment, FinPush, NaturalModes, PaddleThrust, PinchedBending, RingDown
from lab.experiments.fin_drive import FinDrive
from lab.experiments.pinch_drive import PinchDrive
from lab.fields import shown
from lab.specimens import FinnedTube, PinchedTube, Specimen, TwistedBeam
from pipeline.plan import ALL_SOURCES, Plan
from pipeline.provenance import provenance
from pipeline.study import FeaPerformer, Reading
from results.ledger.tables import from_json as ledger_from_json
from results.report import Picture, render
from results.store import write_text
from results.tables import from_json


def report(plan: Plan) -> str:
    """Write ``report.html``; return a line about it."""
    index = json.loads((plan.folder / "pictures" / "index.json").read_text(encoding="utf-8"))
    folder = plan.folder / "pictures"
    pictures = [Picture(folder / p["file"], p["caption"], p["group"], p["folded"]) for p in index["files"]]
    holes = json.loads((plan.folder / "holes.json").read_text(encoding="utf-8"))
    tables = from_json((plan.folder / "tables.json").read_text(encoding="utf-8"))
    ledger = ledger_from_json((plan.folder / "ledger.json").read_text(encoding="utf-8"))
    about = {"study": plan.study.study, "study hash": plan.study.digest(), **provenance(ALL_SOURCES)}
    title = plan.study.title or plan.study.study
    path = plan.folder / "report.html"
    write_text(path, render(title, tables, pictures, index["left_out"], assumptions(plan), holes, about, ledger))
    return f"{path}: {len(tables)} tables, {len(pictures)} pictures"


def assumptions(plan: Plan) -> list[str]:
    """What the text leaves open and this study decides, in words."""
    study = plan.study
    return [
        *(_about_specimen(name, specimen) for name, specimen in study.specimens.items()),
        *(_about_experiment(name, experiment) for name, experiment in study.experiments.items()),
        *(_about_reading(name, table.reading) for name, table in study.lab.items()),
        *(
            _about_virtual_lab(name, performer, next(iter(study.specimens.values())))
            for name, performer in study.performers.items()
            if isinstance(performer, FeaPerformer) and performer.origin == "virtual-lab"
        ),
    ]


def _about_specimen(name: str, specimen: Specimen) -> str:
    if isinstance(specimen, FinnedTube):
        return _about_fins(name, specimen)
    return _about_tube(name, specimen) if isinstance(specimen, PinchedTube) else _about_beam(name, specimen)


def _about_fins(name: str, tube: FinnedTube) -> str:
    chambers = (
        f" The chambers are read as standing beside one another around the tube, {shown(tube.chambers, 'gap')} apart, "
        "their sizes as those of the outside."
        if tube.chambers.number
        else ""
    )
    load = (
        f" Of the load fin only the mass is published: {shown(tube.load_fin, 'length')} beyond the fin's tip follow "
        f"from the Reynolds numbers, {shown(tube.load_fin, 'width')} across are assumed."
        if tube.load_fin
        else ""
    )
    return (
        f"{name}: the text has no drawing. Theta is read as the angle between the fin's generators and the tube's "
        f"axis, the diameter as that of the outside; the crease's middle at {1e3 * tube.place:.4g} mm of the tube, "
        f"the fin's length of {shown(tube, 'fin_length')}, which its Reynolds number implies, and the place of P, the "
        f"tip's corner, are assumed. Poisson's ratio {tube.material.poisson_ratio:g} is not published.{chambers}{load}"
    )


def _about_tube(name: str, tube: PinchedTube) -> str:
    material = tube.material
    names = ("radius", "pad_width", "pad_height", "pad_fillet", "imperfection")
    radius, width, height, fillet, imperfection = (shown(tube, name) for name in names)
    return (
        f"{name}: the text has no drawing of the pads: {width} around and along, {height} high, with transitions of "
        f"{fillet}, and {tube.pad_stiffening:g} times as stiff as the wall are assumed; also that the radius of "
        f"{radius} is that of the outside, that the blocks lie outside the length, and that the tube is out of round "
        f"by {imperfection}, which decides which way it buckles where several are open to it. Poisson's ratio "
        f"{material.poisson_ratio:g} is not published."
    )


def _about_beam(name: str, beam: TwistedBeam) -> str:
    material, frame = beam.material, beam.load_frame
    about_frame = (
        f" Of the load frame only the weight of 20 g is published: its sides of {frame.width * 1e3:g} x "
        f"{frame.height * 1e3:g} mm and its mass of {frame.mass * 1e3:g} g are assumed, and that left and right are "
        "seen from the tip towards the clamp with y up."
        if frame
        else ""
    )
    return (
        f"{name}: Poisson's ratio {material.poisson_ratio:g} and viscous time {material.viscous_time * 1e3:g} ms "
        f"are not published. The dynamics use {beam.effective_density:.0f} kg/m^3: the text gives both 5.17 g and "
        f"1210 kg/m^3, which is {1210 * beam.area * beam.length * 1e3:.2f} g for this volume.{about_frame}"
    )


def _about_experiment(name: str, experiment: Experiment) -> str:
    if isinstance(experiment, RingDown):
        places = "; ".join("(" + ", ".join(f"{c * 1e3:g}" for c in place) + ")" for place in experiment.markers)
        return f"{name}: the load's direction and the markers' places, {places} mm from the tip's centre, are assumed."
    if isinstance(experiment, BaseShake):
        gravity = "is left out" if experiment.own_weight is None else "acts on the beam and what its tip carries"
        return (
            f"{name}: gravity {gravity}, the path is seen from the {experiment.seen_from}, and its marker rides on "
            "the tip's centre unless the study says otherwise: the text says none of it."
        )
    if isinstance(experiment, NaturalModes):
        return f"{name}: small vibrations about the unloaded shape, without damping or gravity."
    if isinstance(experiment, PinchDrive):
        return f"{name}: {_about_pinch(experiment)}"
    if isinstance(experiment, FinDrive):
        return f"{name}: {_about_flattening(experiment)}"
    if isinstance(experiment, PaddleThrust):
        return (
            f"{name}: air is on for {experiment.duty:.0%} of a cycle, which the text's valve of two positions does not "
            f"tell; the first {experiment.warm_up} of {experiment.cycles} cycles are left out of the numbers; no "
            "gravity, as of a device that floats."
        )
    return (
        f"{name}: K' is fitted as to a dense force log at steady speed, which the text does not state; the tip "
        "hardens, so that other spacings give other slopes."
    )


def _about_pinch(experiment: PinchDrive) -> str:
    tendons = (
        "tendons pull opposite pads towards one another along the line between them, at steady speed over "
        f"{shown(experiment, 'duration')}, their forces in a fixed ratio, until contact carries "
        f"{experiment.firmness:g} times F_p: the text has collinear forces and says neither of speed nor of the end."
    )
    if not isinstance(experiment, PinchedBending) or experiment.push is None:
        return tendons
    push = (
        f"where the block is pushed, {shown(experiment, 'place')} beyond its face, and how far, "
        f"{shown(experiment, 'push')}, is not published."
    )
    return f"{tendons} Also {push}" if experiment.pinched else push


def _about_flattening(experiment: FinDrive) -> str:
    length = shown(experiment, "pinch_length") if experiment.pinch_length is not None else "as long as the chambers"
    drive = (
        f"the lines of the wall at +y and -y that the pinch moves, about mid-length, are {length}: the text pinches "
        "'at the midpoint' and no more."
        if experiment.drive == "pinch"
        else "all chambers have one pressure; the way of the air between them is left out."
    )
    if not isinstance(experiment, FinPush):
        return drive
    return (
        f"{drive} The plate meets the fin at {experiment.place:g} of its length and moves along its normal there: the "
        "text says neither."
    )


def _about_reading(name: str, reading: Reading) -> str:
    return (
        f"{name}: published phi is read as {'right' if reading.twist_sense > 0 else 'left'}-handed about +x, "
        f"the clamp of rows {', '.join(reading.turned_rows) or 'none'} as turned by {reading.turned_by}. "
        "The text calls phi > 0 right-handed (5.5) but not which way its x-axis runs, which turns the sign of the "
        "couplings, and says nothing of the clamp. The reading was chosen with sight of all rows: a fit of kind "
        "readings shows the alternatives."
    )


def _about_virtual_lab(name: str, performer: FeaPerformer, beam: Specimen) -> str:
    material = performer.applied_to(beam).material
    return (
        f"{name} is no measurement but a finer FEA that plays the lab: E {material.youngs_modulus / 1e6:g} MPa, "
        f"viscous time {material.viscous_time * 1e3:g} ms, mass damping {material.mass_damping:g} 1/s, marker noise "
        f"{performer.noise * 1e3:g} mm."
    )
