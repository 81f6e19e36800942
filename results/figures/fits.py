"""Figures of fits: objectives, what the records can tell, parameters over designs, models beside each other."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from results.figures.canvas import COLOURS, pyplot, save


def fit_histories(fits: Mapping[str, Mapping[str, Any]], path: Path) -> Path:
    """Objective of each fit against its generation."""
    plt = pyplot()
    figure, axis = plt.subplots(figsize=(6, 3.6), layout="constrained")
    data = []
    for i, (name, fit) in enumerate(fits.items()):
        history = np.asarray(fit["history"]) * 1e3
        axis.semilogy(range(len(history)), history, color=COLOURS[(i + 1) % len(COLOURS)], label=name)
        data += [(name, generation, value) for generation, value in enumerate(history)]
    axis.set(xlabel="generation", ylabel="objective, eq. 5.13 [mm]")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    return save(figure, path, ("fit", "generation", "objective_mm"), data)


def fit_profiles(name: str, fit: Mapping[str, Any], path: Path) -> Path:
    """Profile likelihood of each parameter, and the correlations: what the records can tell apart."""
    plt = pyplot()
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
    return save(figure, path, ("parameter", "unit", "value", "rise"), data)


def parameter_curves(name: str, fit: Mapping[str, Any], path: Path) -> Path:
    """Parameters over one design variable: the fit of each design with its standard error, and the learned curve."""
    plt = pyplot()
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
    return save(figure, path, ("parameter", "unit", f"{sampled['design']}_{unit}", "value"), data)


def model_spread(name: str, fit: Mapping[str, Any], path: Path) -> Path:
    """Held-out error of each model, and the quantities that all have, each with its own 95 % interval."""
    plt = pyplot()
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
    return save(figure, path, ("model", "quantity", "unit", "value", "half_width_95"), data)
