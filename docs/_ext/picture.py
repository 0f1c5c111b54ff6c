"""The README's picture, drawn from a simulated calibration: ``python docs/_ext/picture.py`` writes docs/picture.svg."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

import smartshoe

matplotlib.use("agg")
matplotlib.rcParams["svg.hashsalt"] = "smartshoe"  # the same bytes each time
matplotlib.rcParams["svg.fonttype"] = "none"

import matplotlib.pyplot as plt  # noqa: E402

PICTURE = Path(__file__).resolve().parents[1] / "picture.svg"
EVERY = 10  # samples, so that the file stays small
LOAD, LINE, FILTER = "0.92", "tab:orange", "tab:blue"


def draw(path: Path = PICTURE) -> None:
    """What is wrong on triangles that were not fitted: of the best static line through the reading, and compensated."""
    with smartshoe.open_machine("sim:instron", unit="left_toe", seed=1) as machine:
        fitted = machine.run(smartshoe.dynamic_protocol((50.0, 200.0, 800.0), repeats=2))
        check = machine.run(replace(smartshoe.dynamic_protocol((100.0, 400.0)), name="check"))
    calibration = smartshoe.identify([fitted]).calibration(unit="left_toe")
    load_n, reading = check.force_n, check.sensor.values
    force_n = smartshoe.compensate(check, calibration)
    line_n = np.polyval(np.polyfit(reading, load_n, 1), reading)

    figure, (time, loop) = plt.subplots(
        1, 2, figsize=(8.0, 2.7), sharey=True, width_ratios=(3, 2), layout="constrained"
    )
    seconds, loads_n = check.time_s[::EVERY], load_n[::EVERY]
    behind = time.twinx()
    behind.fill_between(seconds, loads_n, color=LOAD, linewidth=0.0)
    behind.set(ylim=(0.0, 800.0), yticks=[])
    behind.spines[["top", "right"]].set_visible(False)
    time.set_zorder(behind.get_zorder() + 1)
    time.patch.set_visible(False)
    for name, colour, estimate_n in (("best static line", LINE, line_n), ("smartshoe", FILTER, force_n)):
        error_n = (estimate_n - load_n)[::EVERY]
        time.plot(seconds, error_n, color=colour, linewidth=1.0, label=name)
        loop.plot(loads_n, error_n, color=colour, linewidth=1.0)
    time.set(xlabel="time (s), the load behind", ylabel="error of the force (N)")
    time.legend(loc="upper right", frameon=False)
    loop.set(xlabel="load (N)")
    for axes in (time, loop):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, metadata={"Date": None}, facecolor="white")
    plt.close(figure)


if __name__ == "__main__":
    draw()
