"""Figures of numbers and curves (matplotlib); each has the data behind it as CSV beside it."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.accuracy import Entry, Row

#: Okabe and Ito's palette: told apart with every kind of colour vision.
COLOURS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#882255", "#44AA99")
BARS = ("k_yy", "k_zz", "k_yz", "k_zy", "n_xx")


def _pyplot() -> Any:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "scram"})
    return plt


def _save(figure: Any, path: Path, header: Sequence[str], data: Sequence[Sequence[Any]]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=200, metadata={"Software": None})
    figure.clf()
    _pyplot().close(figure)
    with open(path.with_suffix(".csv"), "w", newline="", encoding="utf-8") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(data)
    return path


def stiffness_bars(rows: Sequence[Row], title: str, path: Path) -> Path:
    """Main entries of K' of every model beside the measured ones."""
    plt = _pyplot()
    rows = [row for row in rows if row.quantity in BARS]
    samples = list(dict.fromkeys(row.sample for row in rows))
    models = [
        m for m in dict.fromkeys(row.model for row in rows) if any(r.value == r.value for r in rows if r.model == m)
    ]
    value = {(row.model, row.quantity, row.sample): row.value for row in rows}
    value |= {("lab", row.quantity, row.sample): row.reference_value for row in rows}
    unit = {row.quantity: row.unit for row in rows}
    figure, axes = plt.subplots(1, len(BARS), figsize=(15, 3.8), layout="constrained")
    width = 0.8 / (len(models) + 1)
    for axis, quantity in zip(axes, BARS, strict=True):
        for i, model in enumerate(["lab", *models]):
            heights = [value.get((model, quantity, sample), np.nan) for sample in samples]
            places = np.arange(len(samples)) + (i - len(models) / 2) * width
            axis.bar(
                places, heights, width, color=COLOURS[i % len(COLOURS)], label=f"{model} (measured)" if not i else model
            )
        axis.set_title(f"{quantity} [{unit[quantity]}]")
        axis.set_xticks(
            range(len(samples)), [s.split(":")[0].removeprefix("phi ").replace(" deg", "°") for s in samples]
        )
        axis.set_xlabel("published twist")
        axis.axhline(0, color="black", linewidth=0.6)
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(models) + 1, frameon=False
    )
    figure.suptitle(title)
    data = [(m, q, s, unit[q], value.get((m, q, s))) for m in ["lab", *models] for q in BARS for s in samples]
    return _save(figure, path, ("model", "quantity", "sample", "unit", "value"), data)


def force_curves(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Reaction against motion for the two translations and the rotation, one line per sample."""
    plt = _pyplot()
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    data = []
    panels = (
        (1, "X_y [mm]", "F_y [N]", 1e3),
        (2, "X_z [mm]", "F_z [N]", 1e3),
        (3, "theta_x [deg]", "M_x [N m]", 180 / np.pi),
    )
    for axis, (dof, x_label, y_label, factor) in zip(axes, panels, strict=True):
        for i, entry in enumerate(entries):
            motion, wrench = entry.record["motion"], entry.record["wrench"]
            mine = np.flatnonzero(motion[:, dof])
            order = mine[np.argsort(motion[mine, dof])]
            x, y = motion[order, dof] * factor, wrench[order, dof]
            axis.plot(x, y, ".-", color=COLOURS[i % len(COLOURS)], label=entry.slug, linewidth=1)
            data += [(entry.slug, x_label, a, y_label, b) for a, b in zip(x, y, strict=True)]
        axis.set(xlabel=x_label, ylabel=y_label)
        axis.grid(alpha=0.3)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    figure.suptitle(title)
    return _save(figure, path, ("sample", "motion", "value", "reaction", "value"), data)


def ring_down_overlay(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Mean marker displacement along y and z over time, every performer, one column per sample."""
    plt = _pyplot()
    slugs = list(dict.fromkeys(e.slug for e in entries))
    performers = list(dict.fromkeys(e.performer for e in entries))
    figure, axes = plt.subplots(
        2, len(slugs), figsize=(5 * len(slugs), 5.4), sharex=True, squeeze=False, layout="constrained"
    )
    data = []
    for column, slug in enumerate(slugs):
        for entry in (e for e in entries if e.slug == slug and e.record.completed):
            mean = entry.record["markers"].mean(axis=1) * 1e3
            time, i = entry.record["time"] * 1e3, performers.index(entry.performer)
            style = "-" if entry.record.origin != "prb" else "--"
            for row, (axis_index, name) in enumerate(((1, "y"), (2, "z"))):
                label = f"{entry.performer} ({entry.record.origin})"
                axes[row, column].plot(
                    time, mean[:, axis_index], style, color=COLOURS[i % len(COLOURS)], label=label, lw=1.1
                )
                axes[row, 0].set_ylabel(f"mean marker {name} [mm]")
            data += [(slug, entry.performer, *values) for values in zip(time, mean[:, 1], mean[:, 2], strict=True)]
        axes[0, column].set_title(slug)
        axes[1, column].set_xlabel("time after release [ms]")
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(title)
    return _save(figure, path, ("sample", "performer", "time_ms", "y_mm", "z_mm"), data)


def orbits(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Path of the mean marker across the beam over a period of shaking, one panel per sample, a dot where it begins."""
    plt = _pyplot()
    slugs = list(dict.fromkeys(e.slug for e in entries))
    performers = list(dict.fromkeys(e.performer for e in entries))
    columns = min(len(slugs), 5)
    rows = -(-len(slugs) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(3 * columns, 3 * rows), squeeze=False, layout="constrained")
    data = []
    for axis, slug in zip(axes.flat, slugs, strict=False):
        for entry in (e for e in entries if e.slug == slug):
            mean = entry.record["markers"].mean(axis=1)[:, 1:] * 1e3
            i = performers.index(entry.performer)
            style = "-" if entry.record.origin != "prb" else "--"
            label = f"{entry.performer} ({entry.record.origin})"
            axis.plot(*mean.T, style, color=COLOURS[i % len(COLOURS)], label=label, lw=1.1)
            axis.plot(*mean[0], "o", color=COLOURS[i % len(COLOURS)], ms=3)
            data += [(slug, entry.performer, *point) for point in mean]
        axis.set(title=slug, xlabel="y [mm]", ylabel="z [mm]", aspect="equal", adjustable="datalim")
        axis.grid(alpha=0.3)
    for axis in axes.flat[len(slugs) :]:
        axis.set_visible(False)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(title)
    return _save(figure, path, ("sample", "performer", "y_mm", "z_mm"), data)


def fit_histories(fits: Mapping[str, Mapping[str, Any]], path: Path) -> Path:
    """Objective of each fit against its generation."""
    plt = _pyplot()
    figure, axis = plt.subplots(figsize=(6, 3.6), layout="constrained")
    data = []
    for i, (name, fit) in enumerate(fits.items()):
        history = np.asarray(fit["history"]) * 1e3
        axis.semilogy(range(len(history)), history, color=COLOURS[(i + 1) % len(COLOURS)], label=name)
        data += [(name, generation, value) for generation, value in enumerate(history)]
    axis.set(xlabel="generation", ylabel="objective, eq. 5.13 [mm]")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    return _save(figure, path, ("fit", "generation", "objective_mm"), data)


def fit_profiles(name: str, fit: Mapping[str, Any], path: Path) -> Path:
    """Profile likelihood of each parameter, and the correlations: what the records can tell apart."""
    plt = _pyplot()
    profiles, names = fit["profiles"], [p["name"] for p in fit["parameters"]]
    figure, axes = plt.subplots(1, len(profiles) + 1, figsize=(3.1 * (len(profiles) + 1), 3), layout="constrained")
    data = []
    for axis, profile in zip(axes, profiles, strict=False):
        axis.plot(profile["values"], profile["rise"], ".-", color=COLOURS[1], lw=1.1)
        axis.axhline(3.841, color=COLOURS[2], lw=0.8, ls="--")
        axis.set(xlabel=f"{profile['name']} [{profile['unit']}]", ylim=(-0.3, 12))
        axis.locator_params(axis="x", nbins=3)
        axis.grid(alpha=0.3)
        data += [
            (profile["name"], profile["unit"], *pair) for pair in zip(profile["values"], profile["rise"], strict=True)
        ]
    axes[0].set_ylabel("rise of the sum of squares\n(dashed: 95 %)")
    correlation = np.array(fit["correlation"], dtype=float)
    image = axes[-1].imshow(correlation, vmin=-1, vmax=1, cmap="PuOr")
    for (i, j), value in np.ndenumerate(correlation):
        axes[-1].text(
            j, i, f"{value:.2f}", ha="center", va="center", fontsize=7, color="w" if abs(value) > 0.6 else "k"
        )
    axes[-1].set_xticks(range(len(names)), names)
    axes[-1].set_yticks(range(len(names)), names)
    axes[-1].set_title("correlation")
    figure.colorbar(image, ax=axes[-1], shrink=0.8)
    figure.suptitle(f"fit {name}")
    return _save(figure, path, ("parameter", "unit", "value", "rise"), data)


def parameter_curves(name: str, fit: Mapping[str, Any], path: Path) -> Path:
    """Parameters over one design variable: the fit of each design with its standard error, and the learned curve."""
    plt = _pyplot()
    sampled, curves = fit["sampled"], fit["model"]["curves"]
    angle = sampled["unit"] == "rad"
    factor, unit = (180.0 / np.pi, "deg") if angle else (1.0, sampled["unit"])
    places = np.array([point[0] for point in fit["model"]["points"]]) * factor
    figure, axes = plt.subplots(1, len(curves), figsize=(3.2 * len(curves), 3), squeeze=False, layout="constrained")
    data = []
    for axis, curve in zip(axes[0], curves, strict=True):
        line = sampled["curves"][curve["name"]]
        axis.plot(np.array(sampled["places"]) * factor, line, color=COLOURS[1], lw=1.1)
        known = np.array(curve["known"])
        errors = np.array([np.nan if e is None else e for e in curve["standard_errors"]], dtype=float)
        for mask, style in ((known, "o"), (~known, "x")):
            bars = np.where(np.isfinite(errors[mask]), errors[mask], 0.0) if style == "o" else None
            values = np.array(curve["values"])[mask]
            axis.errorbar(places[mask], values, bars, fmt=style, color=COLOURS[2], ms=4, lw=0.8)
        axis.set(xlabel=f"{sampled['design']} [{unit}]", title=f"{curve['name']} [{curve['unit']}]")
        axis.grid(alpha=0.3)
        data += [
            (curve["name"], curve["unit"], place * factor, value)
            for place, value in zip(sampled["places"], line, strict=True)
        ]
    figure.suptitle(f"fit {name}: points are fits of single designs (crosses: not identified there)")
    return _save(figure, path, ("parameter", "unit", f"{sampled['design']}_{unit}", "value"), data)


def model_spread(name: str, fit: Mapping[str, Any], path: Path) -> Path:
    """Held-out error of each model, and the quantities that all have, each with its own 95 % interval."""
    plt = _pyplot()
    names = [ranked["name"] for ranked in fit["ranked"]]
    spreads = [s for s in fit["spreads"] if all(s["values"].get(n) is not None for n in names)][:5]
    figure, axes = plt.subplots(
        1, 1 + len(spreads), figsize=(3.0 * (1 + len(spreads)), 0.35 * len(names) + 1.6), sharey=True, squeeze=False,
        layout="constrained",
    )  # fmt: skip
    rows = np.arange(len(names))[::-1]
    data: list[tuple[Any, ...]] = []
    for key, colour in (("in_sample", COLOURS[7]), ("held_out", COLOURS[2])):
        values = [np.nan if r[key] is None else 100.0 * r[key] for r in fit["ranked"]]
        axes[0, 0].plot(values, rows, "o", color=colour, label=key.replace("_", " "))
        data += [(n, key, "%", v, "") for n, v in zip(names, values, strict=True)]
    axes[0, 0].set_xscale("log")
    axes[0, 0].legend(frameon=False, fontsize=7)
    axes[0, 0].set(title="tracking error [%]", yticks=rows, yticklabels=names)
    for axis, spread in zip(axes[0, 1:], spreads, strict=True):
        values = [spread["values"][n] for n in names]
        widths = [spread["half_widths"].get(n) or 0.0 for n in names]
        axis.errorbar(values, rows, xerr=widths, fmt="o", color=COLOURS[1], ms=4, lw=1)
        axis.set(title=f"{spread['name']} [{spread['unit']}]".replace("_", " "))
        axis.locator_params(axis="x", nbins=4)
        data += [(n, spread["name"], spread["unit"], v, w) for n, v, w in zip(names, values, widths, strict=True)]
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    figure.suptitle(f"fit {name}: bars are each model's own 95 % interval, which takes the model for true")
    return _save(figure, path, ("model", "quantity", "unit", "value", "half_width_95"), data)
