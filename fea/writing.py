"""A run as a record: curves and fields that ``results.store.write_record`` writes for ParaView and xarray."""

import re

import numpy as np
from numpy.typing import NDArray

from fea.run import Run
from lab.records import Channel, Fields, Record, channels

Array = NDArray[np.float64]
_AXES = ("increment", "axis")
#: "force x [N], term 0", "active points, term 0".
_REPORTED = re.compile(r"(.*?)(?: \[(.*)\])?, (term \d+)")


def record(run: Run, name: str, stresses: bool = True) -> Record:
    """Curves of what was watched, energies, and fields on the meshes of all parts.

    Parameters
    ----------
    run
        Static run, traced path or motion.
    name
        Name of the case.
    stresses
        Mean Cauchy stress of every element at every increment; takes longer to make.
    """
    motion = bool(run._kinetic)
    curves = [
        Channel("t", "s" if motion else "1", run.t, ("increment",), "time" if motion else "load factor"),
        Channel("strain_energy", "J", run.energy, ("increment",), "strain energy, springs and contact included"),
        Channel("work", "J", run.work, ("increment",), "work of loads and supports"),
    ]
    if motion:
        curves.append(Channel("kinetic_energy", "J", run.kinetic, ("increment",), "kinetic energy"))
    for place in run.case.watched:
        curves.append(Channel(f"displacement_{place}", "m", run.displacement(place), _AXES, f"displacement of {place}"))
        curves.append(Channel(f"reaction_{place}", "N", run.reaction(place), _AXES, f"force that holds {place}"))
    for rigid in run.case.rigids:
        words = f"force, and moment about its moved reference point, that hold {rigid}"
        curves.append(Channel(f"wrench_{rigid}", "N, N*m", run.wrench(rigid), ("increment", "dof"), words))
    for key in run.reports[-1]:
        label, unit, term = _REPORTED.fullmatch(key).groups()  # type: ignore[union-attr]
        values = np.array([report.get(key, np.nan) for report in run.reports])
        name_of = f"{label} {term}".replace(" ", "_")
        curves.append(Channel(name_of, unit or "1", values, ("increment",), f"{label} of {term}"))
    elements = [{"kind": p.kind, "elements": len(p.cells), "nodes": p.nodes} for p in run.case.parts]
    return Record(
        "fea", "case", {"case": name}, {}, channels=channels(*curves),
        how={"parts": elements, "unknowns": run.problem.links.unknowns, "history": run.history,
             "wall_time_s": run.wall_time, "reached": run.reached, "notes": run.notes},
        status=run.status, reason=run.reason, fields=_fields(run, stresses),
    )  # fmt: skip


def _fields(run: Run, stresses: bool) -> Fields:
    pictures = [part.picture() for part in run.case.parts]
    sizes = [len(points) for points, *_ in pictures]
    starts = np.cumsum([0, *sizes[:-1]])
    width = max(cells.shape[1] for _, cells, *_ in pictures)
    padded = [
        np.pad(cells + start, ((0, 0), (0, width - cells.shape[1])), constant_values=-1)
        for start, (_, cells, *_) in zip(starts, pictures, strict=True)
    ]
    types = np.concatenate([np.full(len(cells), kind) for _, cells, kind, _ in pictures])

    def carried(nodal: Array) -> Array:
        places = zip(pictures, run.problem.places, strict=True)
        return np.concatenate([carry(nodal[place]) for (*_, carry), place in places])

    point_data = [Channel("displacement", "m", np.array([carried(x) for x in run._fields]), ("state", "point", "axis"))]
    for key in run._contact[-1]:
        label, _, unit = key[:-1].partition(" [")
        values = [carried(fields.get(key, np.full(len(run.case.points), np.nan))) for fields in run._contact]
        point_data.append(Channel(label.replace(" ", "_"), unit, np.array(values), ("state", "point")))
    return Fields(
        points=np.concatenate([points for points, *_ in pictures]),
        cells=np.concatenate(padded),
        cell_type=int(types[0]) if (types == types[0]).all() else types,
        values=run.t,
        point_data=channels(*point_data),
        cell_data=channels(*_cell_data(run, stresses)),
    )


def _cell_data(run: Run, stresses: bool) -> list[Channel]:
    parts = list(zip(run.case.parts, run.problem.places, strict=True))
    density = [np.concatenate([p.strain_energy(x[place]) / p.volumes for p, place in parts]) for x in run._fields]
    result = [Channel("strain_energy_density", "J/m^3", np.array(density), ("state", "cell"), "mean of the element")]
    if stresses:
        points = [[p.stresses(x[place]) for p, place in parts] for x in run._fields]
        mean = np.array([np.concatenate([stress.mean(axis=1) for stress in state]) for state in points])
        peak = np.array([np.concatenate([von_mises(stress).max(axis=1) for stress in state]) for state in points])
        result.append(Channel("stress", "Pa", mean, ("state", "cell", "axis"), "mean Cauchy stress, 11 22 33 12 13 23"))
        result.append(Channel("von_mises", "Pa", peak, ("state", "cell"), "largest at the points of the element"))
    return result


def von_mises(stress: Array) -> Array:
    """Von Mises stress (...) of stresses (..., 6) in Voigt order 11, 22, 33, 12, 13, 23."""
    direct, shear = stress[..., :3], stress[..., 3:]
    apart = direct - np.roll(direct, 1, axis=-1)
    return np.sqrt(0.5 * (apart**2).sum(axis=-1) + 3.0 * (shear**2).sum(axis=-1))
