"""Every table about pinched tubes: pinches, push tests, directions, recovery, hysteresis, materials, accuracy."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from lab.elastic_limits import elastic_limit
from lab.experiments import PinchedBending
from results.accuracy import Entry, Row
from results.bending_tables import load_table, loss_table, push_tables, recovery_table
from results.pinch_series import PinchSeries, pinch_series
from results.pinch_tables import pinch_tables
from results.push_tests import push_tests
from results.sensitivity_tables import sensitivity_tables
from results.summary import errors_by_quantity
from results.tables import Table, layout, shown

TUBE_EXPERIMENTS = ("Pinch", "PinchedBending", "ShapeRecovery")
#: Motions across the load vanish by symmetry.
_MOVES = ("move_x", "move_y", "move_z")
#: Quantities whose errors follow from those of others.
_TOLD_TWICE = ("touch_force", "touch_travel", "deformation_axis_error", "hinge_axis_error", "k_initial")
_MATERIALS = (
    "criteria of 3.3.1: force, stiffness across the hinge over that about it, and strain over what the material takes "
    "without a lasting one (assumed values, lab/data/elastic_limits.yaml)"
)


def tube_tables(entries: Sequence[Entry]) -> Iterator[Table]:
    """All tables that records of tubes fill, those without a line left out."""
    series, tests = pinch_series(entries), push_tests(entries)
    yield from pinch_tables(series)
    loaded = [e for e in entries if isinstance(e.experiment, PinchedBending) and e.experiment.load is not None]
    ours, models = ([e for e in loaded if (e.record.origin == "prb") is prb] for prb in (False, True))
    for table in (
        _material_table(series), *push_tables(tests), load_table("dead loads", ours),
        replace(load_table("dead loads by PRB models", models), detail=True), recovery_table(entries),
        loss_table(entries),
    ):  # fmt: skip
        if table.rows:
            yield table
    yield from sensitivity_tables(entries)


def tube_comparison(title: str, rows: Sequence[Row]) -> list[Table]:
    """Errors of each model in and out of sample over all samples, then every number."""
    told = [row for row in rows if row.quantity not in _TOLD_TWICE]
    return [errors_by_quantity(title, told, _MOVES, by_use=True), replace(layout(title, rows), detail=True)]


def _material_table(series: Sequence[PinchSeries]) -> Table:
    """Pinches by one pair alone, one line per tube; nothing where all are of one material."""
    # Series by several laws share their first pinch.
    known = {id(one.first): (one, one.first) for one in reversed(series) if one.first is not None}
    starts = [pair for pair in reversed(known.values()) if pair[0].origin != "prb"]
    lines = []
    for one, point in starts:
        limit, strain = elastic_limit(one.specimen.material), point.value("largest_strain")
        allowed = limit.strain if limit else math.nan
        size = f"{2e3 * one.specimen.radius:g} x {1e3 * one.specimen.length:g} x {1e3 * one.specimen.wall:g}"
        lines.append(
            (
                one.label, one.performer, limit.name if limit else "-",
                shown(one.specimen.material.youngs_modulus, "Pa"), size, shown(point.value("closing_force"), ""),
                shown(point.value("anisotropy"), ""), shown(100 * strain, ""), shown(100 * allowed, ""),
                shown(strain / allowed, ""),
            )
        )  # fmt: skip
    header = (
        "tube", "by", "material", "modulus", "D x L x t [mm]", "1: closing force [N]", "2: anisotropy", "strain [%]",
        "elastic to [%]", "3: strain over that",
    )  # fmt: skip
    several = len({one.specimen.material for one, _ in starts}) > 1
    return Table("choice of material", header, tuple(lines) if several else (), (_MATERIALS,))
