"""``python -m simulators.people``: what the simulated people do at each speed, measured from their true loads."""

from __future__ import annotations

import time

import numpy as np

from simulators.people._trial import blocks, trial
from simulators.people.person import Person, move_at

SPEEDS_M_PER_S = (0.8, 1.0, 1.3, 1.6, 2.0, 2.68, 3.5)
DURATION_S = 1200.0
DAY_S = 16 * 3600.0


def table() -> str:
    """Cadence, stance, variation, peaks and momentum by speed, as rows of a Markdown table."""
    rows = [
        "| speed (m/s) | does | cadence (1/min) | stance (%) | stride time CV (%) | peak CV (%) | peak (BW)"
        " | mean total (BW) |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for speed in SPEEDS_M_PER_S:
        person, move = Person(), move_at(speed)
        made = trial(person, move, DURATION_S, np.random.default_rng(1), sensors=False)
        strikes, offs = made.times_s("left", "heel_strike"), made.times_s("left", "toe_off")
        stride_s = np.diff(strikes)
        at = np.searchsorted(made.time_s, strikes)
        peak = np.maximum.reduceat(made.total_n["left"], at)[1:-1] / person.body_weight_n
        total = (made.total_n["left"] + made.total_n["right"])[at[0] : at[-1]]
        stance = offs[: stride_s.size] - strikes[:-1]
        rows.append(
            f"| {speed:g} | {type(move).__name__.lower()} | {120.0 / stride_s.mean():.0f}"
            f" | {100.0 * np.mean(stance / stride_s):.1f} | {100.0 * stride_s.std() / stride_s.mean():.2f}"
            f" | {100.0 * peak.std() / peak.mean():.2f} | {peak.mean():.2f}"
            f" | {total.mean() / person.body_weight_n:.4f} |"
        )
    return "\n".join(rows)


def pace(sensors: bool, duration_s: float) -> str:
    """How fast a walk is simulated, block by block."""
    begun = time.perf_counter()
    strikes = 0
    for block in blocks(None, None, duration_s, np.random.default_rng(1), sensors=sensors):
        strikes += sum(event.event == "heel_strike" for event in block.events)
    took_s = time.perf_counter() - begun
    through = "through eight units" if sensors else "true loads and events"
    speed = f"{duration_s / took_s:.0f} times real time"
    return f"{through}: {duration_s / 3600:g} h, {strikes} stances in {took_s:.1f} s, {speed}"


if __name__ == "__main__":
    print(table())
    print(pace(False, DAY_S))
    print(pace(True, DAY_S))
