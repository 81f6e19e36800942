"""Figures of free motions over time."""

from collections.abc import Sequence
from pathlib import Path

from results.accuracy import Entry
from results.figures.canvas import COLOURS, pyplot, save


def ring_down_overlay(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Mean marker displacement along y and z over time, every performer, one column per sample."""
    plt = pyplot()
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
    return save(figure, path, ("sample", "performer", "time_ms", "y_mm", "z_mm"), data)
