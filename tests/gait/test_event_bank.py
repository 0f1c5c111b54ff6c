"""Events of 10,000 strides against their truth: all speeds, asymmetric, drifting, through bladder and sensor.

pytest -m bank tests/gait/test_event_bank.py -s
"""

from __future__ import annotations

import numpy as np
import pytest
from event_scoring import Score, scores

from simulators.people import Person, Run, Walk, trial
from smartshoe.gait import analyse

SPEEDS_M_PER_S = (0.8, 1.1, 1.4, 1.7, 2.0)
STRIDES = 10_000
# name, person, zero drift over the trial as a share of body weight or of the sensor's range, sensors
CASES = (
    ("forces", Person(), 0.0, False),
    ("30 % asymmetry of load and time, 5 % drift", Person(load_asymmetry=0.3, time_asymmetry=0.3), 0.05, False),
    ("bladder, sensor, hysteresis, 12 bits", Person(), 0.0, True),
    ("the same, 30 % asymmetry, 5 % drift", Person(load_asymmetry=0.3, time_asymmetry=0.3), 0.05, True),
)
HYSTERESIS = {"*": {"bladder": {"hysteresis": {"strength": 0.02}}}}


def _joined(parts: list[Score]) -> Score:
    return Score(
        np.concatenate([part.error_s for part in parts]),
        sum(part.missed for part in parts),
        sum(part.false for part in parts),
        sum(part.true for part in parts),
    )


def _row(name: str, kind: str, whole: Score) -> str:
    return (
        f"{name:44s} {kind:12s} {whole.true:7d} {whole.median_ms:8.1f} {whole.p95_ms:8.1f}"
        f" {whole.missed_percent:9.3f} {whole.false_percent:9.3f}"
    )


@pytest.mark.bank
@pytest.mark.parametrize(("name", "person", "drift", "sensors"), CASES, ids=[case[0] for case in CASES])
def test_events_of_ten_thousand_strides(name: str, person: Person, drift: float, sensors: bool) -> None:
    found: dict[str, list[Score]] = {}
    for speed in SPEEDS_M_PER_S:
        move = Walk(speed)
        strides_a_second = move.cadence(person) / 60.0  # of both feet
        made = trial(
            person, move, STRIDES / len(SPEEDS_M_PER_S) / strides_a_second, np.random.default_rng(int(100 * speed)),
            sensors=sensors, noise_n=0.0 if sensors else 2.0, drift=drift, units=HYSTERESIS if sensors else None,
        )  # fmt: skip
        for kind, own in scores(analyse(made.recording), made).items():
            found.setdefault(kind, []).append(own)
    print(f"\n{'':44s} {'event':12s} {'true':>7s} {'med. ms':>8s} {'95 % ms':>8s} {'missed %':>9s} {'false %':>9s}")
    for kind, parts in found.items():
        whole = _joined(parts)
        print(_row(name, kind, whole))
        if kind in ("heel_strike", "toe_off"):
            assert whole.true > 0.98 * STRIDES
            assert whole.median_ms < 10.0
            assert whole.p95_ms < 20.0
            assert whole.missed_percent < 0.1
            assert whole.false_percent < 0.1


@pytest.mark.bank
def test_events_of_running() -> None:
    parts: dict[str, list[Score]] = {}
    for speed in (2.2, 2.68, 3.5, 4.5):
        made = trial(Person(), Run(speed), 600.0, np.random.default_rng(int(100 * speed)), sensors=False, noise_n=2.0)
        for kind, own in scores(analyse(made.recording), made).items():
            parts.setdefault(kind, []).append(own)
    print()
    for kind in parts:
        whole = _joined(parts[kind])
        print(_row("running, forces", kind, whole))
        if kind in ("heel_strike", "toe_off"):
            assert whole.median_ms < 10.0
            assert whole.missed_percent < 0.1
            assert whole.false_percent < 0.1
