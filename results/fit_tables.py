"""What a fit found, as tables for people."""

from collections.abc import Iterator, Mapping
from typing import Any

from results.tables import Table, shown

_PARAMETERS = ("parameter", "value", "standard error", "95 % interval", "bootstrap 95 %", "bounds")
_RECORDS = ("record", "use", "error [%]", "eq. 5.13 [mm]", "sensors", "note")


def fit_tables(results: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """Tables of all fits by name, from their results as JSON data."""
    return [table for name, result in results.items() for table in _tables(name, result)]


def _tables(name: str, result: Mapping[str, Any]) -> Iterator[Table]:
    title = f"fit {name}"
    if result["status"] != "completed":
        yield Table(title, ("parameter",), (), (result["reason"],))
        return
    for table in result.get("tables", ()):
        yield Table(
            f"{title}: {table['title']}",
            tuple(table["header"]),
            tuple(map(tuple, table["rows"])),
            tuple(table["notes"]),
        )
    if result["parameters"]:
        yield Table(title, _PARAMETERS, tuple(_parameters(result)), tuple(result["notes"]))
    if result.get("targets"):
        yield Table(f"{title}: records", _RECORDS, tuple(map(_record, result["targets"])))


def _parameters(result: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    again = result.get("bootstrap") or {"names": []}
    for p in [*result["parameters"], *result.get("nuisances", ())]:
        unit = p["unit"]
        spread = ""
        if p["name"] in again["names"]:
            spread = _pair(again["intervals"][again["names"].index(p["name"])], unit)
        yield (
            p["name"], shown(p["value"], unit), shown(p["standard_error"], unit),
            _pair(p.get("interval") or (None, None), unit), spread, _pair((p["lower"], p["upper"]), unit),
        )  # fmt: skip


def _pair(ends: Any, unit: str) -> str:
    low, high = (shown(end, unit) for end in ends)
    return "-" if low == high == "-" else f"{low} to {high}"


def _record(target: Mapping[str, Any]) -> tuple[str, ...]:
    sensors = "; ".join(f"{name} {_sensor(name, value)}" for name, value in target["nuisances"].items())
    error, rms = target["error"], target["rms"]
    entries = "; ".join(f"{name} {value:+.0%}" for name, value in target["entries"].items() if value is not None)
    return (
        target["name"], target["use"], "-" if error is None else f"{100 * error:.3g}",
        "-" if rms is None else f"{1e3 * rms:.3g}", sensors, "; ".join(filter(None, (entries, target["note"]))),
    )  # fmt: skip


def _sensor(name: str, value: Any) -> str:
    if name == "offset":
        return f"up to {1e3 * max(abs(c) for marker in value for c in marker):.2g} mm"
    return f"{1e3 * value:.3g} ms" if name == "release_time" else f"{value:.4g}"
