"""Measured sensors: what is known of each set, what a plain least-squares fit reaches, what the diagnosis answers.

What is known stands in the sets' NOTES.md: `first` are effects or families of which one should be named first,
`second` what should be named as well, `trap` that no extension may be worse on another rate. The plain fits are made
here on the same files: a standard linear solid with one free offset a recording, and a smooth curve of the load whose
output relaxes with one pole, both by least squares, judged on the files that are held out with their offset refitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bank_worlds import diagnosed
from judging import said
from numpy.typing import NDArray

import smartshoe
from simulators.hidden._baseline import lagged
from smartshoe.recording import Recording

Array = NDArray[np.float64]

POLES = np.geomspace(0.01, 30.0, 25)
KNOTS = 6


@dataclass(frozen=True)
class Set:
    """One way to use the files: patterns of those to fit and to hold out, the sensor's column, what is known."""

    fit: tuple[str, ...]
    hold_out: tuple[str, ...]
    sensor: str
    first: tuple[str, ...]
    second: tuple[str, ...] = ()
    trap: bool = False


SETS: dict[str, Set] = {
    "air_sweep": Set(("air_sweep_fit_*.csv",), ("air_sweep_hold_*.csv",), "pressure_v", ("static_curve",), ("zero",)),
    "velostat": Set(("velostat_pike1_fit.csv",), ("velostat_pike1_hold.csv",), "resistance_ohm", ("static_curve",)),
    "vhb_two_rates": Set(("vhb_0d01.csv", "vhb_0d03.csv"), ("vhb_0d05.csv",), "position_mm",
                         ("relaxation", "static_curve")),
    "vhb_one_rate": Set(("vhb_0d01.csv",), ("vhb_0d05.csv",), "position_mm", (), (), True),
    "microfluidic": Set(("microfluidic_*fit*.csv",), ("microfluidic_*hold*.csv",), "pressure_v",
                        ("static_curve", "relaxation")),
}  # fmt: skip


def measured(name: str, folder: Path) -> dict[str, Any]:
    """The row of one set."""
    one = SETS[name]
    fit, held = (_read(folder, patterns, one.sensor) for patterns in (one.fit, one.hold_out))
    answer = diagnosed(fit, held)
    return {**answer, "plain": {"solid": _solid(fit, held), "curve_then_pole": _curve(fit, held)},
            "known": {"first": one.first, "second": one.second, "trap": one.trap}}  # fmt: skip


def _read(folder: Path, patterns: Sequence[str], sensor: str) -> list[Recording]:
    paths = [path for pattern in patterns for path in sorted(folder.glob(pattern))]
    if not paths:
        raise FileNotFoundError(f"{folder} holds no {' or '.join(patterns)}")
    return [smartshoe.read(path, force="force_n", sensors=sensor) for path in paths]


def _grid(recording: Recording) -> tuple[Array, Array, float]:
    """Load and reading (n,) on an even grid, and its step."""
    step_s = float(np.median(np.diff(recording.time_s)))
    time_s = np.arange(recording.time_s[0], recording.time_s[-1], step_s)
    channels = (recording.force_n, recording.sensor.values)
    load, reading = (np.interp(time_s, recording.time_s, channel) for channel in channels)
    return load, reading, step_s


def _judged(fit: Sequence[Recording], held: Sequence[Recording], columns: Any) -> float:
    """Variance explained (%) on ``held`` of a linear fit of ``columns(load, step, pole)``, the best pole on ``fit``."""

    def stacked(recordings: Sequence[Recording], pole: float) -> tuple[Array, Array]:
        parts, targets = [], []
        for load, reading, step_s in map(_grid, recordings):
            part = columns(load, step_s, pole)
            parts.append(part - part.mean(axis=0))  # an offset of each recording
            targets.append(reading - reading.mean())
        return np.concatenate(parts), np.concatenate(targets)

    best: tuple[float, float, Array] | None = None
    for pole in POLES:
        a, y = stacked(fit, float(pole))
        weights = np.linalg.lstsq(a, y, rcond=1e-8)[0]
        left = float(np.sum((y - a @ weights) ** 2))
        if best is None or left < best[0]:
            best = left, float(pole), weights
    assert best is not None
    a, y = stacked(held, best[1])
    return 100.0 * (1.0 - float(np.sum((y - a @ best[2]) ** 2) / np.sum(y**2)))


def _solid(fit: Sequence[Recording], held: Sequence[Recording]) -> float:
    return _judged(fit, held, lambda load, h, pole: np.column_stack([load, lagged(load, h, pole)]))


def _curve(fit: Sequence[Recording], held: Sequence[Recording]) -> float:
    highest = max(float(r.force_n.max()) for r in fit)

    def columns(load: Array, step_s: float, pole: float) -> Array:
        hinges = [np.maximum(load / highest - k / KNOTS, 0.0) ** 2 for k in range(KNOTS)]
        curves = [load / highest, *hinges]
        return np.column_stack([*curves, *(lagged(c, step_s, pole) for c in curves)])

    return _judged(fit, held, columns)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """The sets as a Markdown table."""
    lines = [
        "", "## measured", "",
        "| set | known: first; second | answer | right | held out | plain: solid, curve then pole | s |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for row in sorted(rows, key=lambda r: r["kind"]):
        found, known = row["found"], row["known"]
        if "verdict" not in found:
            lines.append(f"| {row['kind']} | | raised {found['error']} | no | | | |")
            continue
        fits = [(found.get(key) or {}).get("fit_percent") for key in ("baseline", "extended")]
        told = ", ".join("-" if fit is None else f"{_variance(fit):.1f}" for fit in fits)
        plain = ", ".join(f"{value:.1f}" for value in row["plain"].values())
        lines.append(
            f"| {row['kind']} | {'/'.join(known['first']) or 'no claim'}; {'/'.join(known['second']) or '-'} |"
            f" {said(found)} | {'yes' if is_right(row) else 'no'} | {told} | {plain} | {row['cpu_s']:.1f} |"
        )
    return "\n".join(lines)


def is_right(row: dict[str, Any]) -> bool:
    """Whether the first cause is of a kind that is known, the second named at all, and a trap not stepped into."""
    found, known = row["found"], row["known"]
    fits = [(found.get(key) or {}).get("fit_percent") for key in ("baseline", "extended")]
    no_worse = None in fits or fits[1] >= fits[0] - 1e-6
    if known["trap"]:
        return bool(no_worse)
    words = [{cause["effect"], cause["family"]} for cause in found.get("causes", [])]
    first = bool(words) and bool(words[0] & set(known["first"]))
    second = not known["second"] or any(word & set(known["second"]) for word in words)
    return first and second and bool(no_worse)


def _variance(fit_percent: float) -> float:
    """Variance explained (%) from a fit in percent, 100 (1 - rms of error / rms about the mean)."""
    return 100.0 * (1.0 - (1.0 - 0.01 * fit_percent) ** 2) if fit_percent > -1e3 else float("-inf")
