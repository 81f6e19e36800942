"""A snake-like arm of three pinched tubes: where its tip can go as the tubes choose their hinges (chapter 8).

    python examples/snake_arm.py runs/pinched-tube/fits/hinge.json OUTPUT_FOLDER

The first file is the result of a fit of kind hinge.  Written are ``workspace.png`` with its data as CSV, and
``arm.xml``, one posture of the arm as MJCF with its cable.
"""

import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from lab.specimens import PinchedTube
from prb.arm import Arm, Cable, Choice
from prb.hinge_curves import HingeCurves
from prb.model import PrbModel
from prb.statics import NotConverged
from results.figures.canvas import COLOURS, pyplot, save

TUBES = 3
BLOCKS, PAYLOAD = 0.010, 0.020  # kg: ASSUMED, small servos and a gripper
TENSION, OFFSET = 2.0, 0.020  # N, and m off the middle line: ASSUMED
SIDES = np.deg2rad([-90.0, 30.0, 150.0])  # of the cables, of which one is pulled at a time
TILT = np.deg2rad(15.0)  # of the hanging arm that bends by its weight alone
#: Open, or closed at every 60 degrees of alpha.
OPTIONS: list[Choice] = [None, *np.deg2rad(np.arange(0.0, 360.0, 60.0))]


def arms(curves: HingeCurves) -> dict[str, list[Arm]]:
    """Hanging arms: one is tilted and bends by its weight, the other is pulled by any one of three cables.

    Held out horizontally, tubes of TPU with several closed hinges do not bear their own weight.
    """
    tube = PinchedTube.model_validate(curves.specimen)
    model = PrbModel(topology="tube-shear", hinge=curves)
    common: dict[str, Any] = {"count": TUBES, "block_mass": BLOCKS, "payload": PAYLOAD}
    tilted = (0.0, -9.81 * np.sin(TILT), 9.81 * np.cos(TILT))
    pulled = [
        Arm(tube, model, gravity=(0.0, 0.0, 9.81), cable=Cable(OFFSET, side, TENSION), **common) for side in SIDES
    ]
    return {"tilted, bent by its weight": [Arm(tube, model, gravity=tilted, **common)],
            "straight down, pulled by one of three cables": pulled}  # fmt: skip


def draw(
    arms: dict[str, list[Arm]], tips: dict[str, np.ndarray], choices: list[tuple[Choice, ...]], path: Path
) -> Path:
    """Tips (arms, postures, 3), m, from the end and from the side, coloured by how many tubes are closed."""
    plt = pyplot()
    figure, axes = plt.subplots(2, len(arms), figsize=(9.0, 7.0), height_ratios=(3, 2), layout="constrained")
    closed = np.array([sum(choice is not None for choice in some) for some in choices])
    rows = []
    for (name, alike), (across, side) in zip(arms.items(), axes.T, strict=True):
        for count in range(TUBES, -1, -1):
            mine = 1e3 * tips[name][:, closed == count].reshape(-1, 3)
            look = {"ms": 8 - 2 * count, "color": COLOURS[count], "label": f"{count} of {TUBES} tubes pinched"}
            across.plot(mine[:, 0], mine[:, 1], ".", zorder=5 - count, **look)
            side.plot(mine[:, 2], mine[:, 1], ".", zorder=5 - count, **look)
        for posture in ((None,) * TUBES, (0.0,) * TUBES, (0.0, None, None), (None, None, 0.0)):
            try:
                line = 1e3 * alike[0].rest(posture).line
            except NotConverged:
                continue
            side.plot(line[:, 2], line[:, 1], "-", lw=1.0, color="0.6", zorder=0)
        across.set(title=name, xlabel="x [mm]", ylabel="y [mm]")
        across.set_aspect("equal", adjustable="datalim")
        side.set(xlabel="z, along the straight arm [mm]", ylabel="y [mm]")
        for number, places in enumerate(tips[name]):
            for posture, place in zip(choices, places, strict=True):
                said = ["open" if choice is None else f"{np.rad2deg(choice):g}" for choice in posture]
                rows.append([name, number, *said, *(1e3 * place)])
    axes[0, 0].legend(fontsize=7)
    header = ["arm", "cable", *(f"alpha of tube {k + 1} [deg]" for k in range(TUBES)), "x [mm]", "y [mm]", "z [mm]"]
    return save(figure, path, header, rows)


def main(fit: Path, folder: Path, options: list[Choice]) -> dict[str, np.ndarray]:
    """Write everything; tips (arms, postures, 3), m, by name."""
    result = json.loads(fit.read_text(encoding="utf-8"))
    if "hinge" not in result:
        raise SystemExit(f"{fit} is no result of a fit of kind hinge: {result.get('reason') or 'it has no curves'}")
    curves = HingeCurves.model_validate(result["hinge"])
    known = [choice for choice in options if choice is None or not curves.refusal(choice)]
    found = arms(curves)
    choices = list(product(known, repeat=TUBES))
    tips = {name: np.array([arm.workspace(known)[1] for arm in alike]) for name, alike in found.items()}
    draw(found, tips, choices, folder / "workspace.png")
    pulled = list(found.values())[-1][0]
    (folder / "arm.xml").write_text(pulled.to_mjcf([known[-1]] * TUBES), encoding="utf-8")
    return tips


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    for title, places in main(Path(sys.argv[1]), Path(sys.argv[2]), OPTIONS).items():
        every = 1e3 * places.reshape(-1, 3)
        stable = every[np.isfinite(every[:, 0])]
        reach = " x ".join(f"{size:.0f}" for size in np.ptp(stable, axis=0))
        print(f"{title}: {len(every)} postures, {len(every) - len(stable)} without a stable equilibrium; {reach} mm")
