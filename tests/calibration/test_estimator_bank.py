"""Which estimator is best on simulated truth, by how much, at which speed and noise: the table of docs/estimators.md.

``pytest -m bank tests/calibration/test_estimator_bank.py -s``
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import smartshoe
from simulators.people import Person, Run, Stand, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.calibration.estimators import estimator, estimator_names
from smartshoe.protocol import dynamic_protocol, static_protocol
from smartshoe.recording import REGIONS

SETTLED = slice(600, None)  # the first three seconds
CASES: dict[str, Any] = {
    "standing": Stand(),
    "walk 0.8 m/s": Walk(speed_m_per_s=0.8),
    "walk 1.4 m/s": Walk(speed_m_per_s=1.4),
    "walk 2.0 m/s": Walk(speed_m_per_s=2.0),
    "run 2.68 m/s": Run(speed_m_per_s=2.68),
}
UNITS: dict[str, dict[str, Any]] = {
    "as built": {},
    "noise 0.3 %": {"sensor": {"noise_percent": 0.3}},
    "friction 2 %": {"bladder": {"hysteresis": {"strength": 0.02, "half_width_n": 40.0}}},
}


def calibrations(options: dict[str, Any], seed: int) -> tuple[dict[str, Calibration], dict[str, Calibration]]:
    """Plain and extended calibrations of the left shoe's units on the simulated machine."""
    plain: dict[str, Calibration] = {}
    extended: dict[str, Calibration] = {}
    for number, region in enumerate(REGIONS):
        unit = f"left_{region}"
        machine = smartshoe.open_machine("sim:instron", unit=unit, seed=seed + number, **options)
        with machine:
            recordings = [machine.run(static_protocol()), machine.run(dynamic_protocol(repeats=2))]
        plain[unit] = smartshoe.identify(recordings).calibration()
        if "bladder" in options:
            found = smartshoe.diagnose(recordings)
            if found.model is not None:
                extended[unit] = found.calibration(unit=unit)
    return plain, extended


@pytest.mark.bank
def test_which_estimator_is_best() -> None:
    print(
        "\n| units | trial | " + " | ".join(estimator_names()) + " |\n| --- | --- |" + " --- |" * len(estimator_names())
    )
    best: dict[tuple[str, str], str] = {}
    for kind, options in UNITS.items():
        plain, extended = calibrations(options, seed=100)
        for case, activity in CASES.items():
            made = trial(
                Person(body_weight_n=700.0), activity, 30.0, np.random.default_rng(42), sides=("left",),
                units={"*": options},
            )  # fmt: skip
            cells = []
            scores: dict[str, float] = {}
            for name in estimator_names():
                chosen = extended if name == "inverse" else plain
                if not chosen:
                    cells.append("")
                    continue
                error, inside = [], []
                for unit, calibration in chosen.items():
                    found = estimator(name, calibration, 200.0).estimate(made.recording.channels[unit].values)
                    off = (found.force_n - made.unit_n[unit])[SETTLED]
                    error.append(off)
                    inside.append(np.abs(off) < 1.96 * found.sd_n[SETTLED])
                scores[name] = float(np.sqrt(np.mean(np.square(error))))
                cells.append(f"{scores[name]:.2f} N ({100.0 * np.mean(inside):.0f} %)")
            best[kind, case] = min(scores, key=lambda name: scores[name])
            print(f"| {kind} | {case} | " + " | ".join(cells) + " |")
    assert all(name != "static" for (kind, _), name in best.items() if kind != "friction 2 %")
