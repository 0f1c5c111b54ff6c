"""Force sensors of other kinds, each by its own textbook equation: what a line and one relaxation lack is told."""

from __future__ import annotations

import pytest

from simulators.other_sensors import OTHER_SENSORS, OUTSIDE
from smartshoe.diagnosis import Thresholds, diagnose

STANDARD = Thresholds()
DAILY = {(frozenset(sensor.kinds), name in OUTSIDE): name for name, sensor in OTHER_SENSORS.items()}  # of each kind one
# What they lack others here ask for daily, or test_hidden_beyond_the_fit.py and test_hidden_friction.py.
FURTHER = ("thickening", "ionic_gel", "magnet", "sticky", "with_play")


def _marks(name: str, seed: int) -> list[pytest.MarkDecorator]:
    if seed or name not in DAILY.values():
        return [pytest.mark.bank]
    return [pytest.mark.long] if name in FURTHER else []


CASES = [
    pytest.param(name, seed, marks=_marks(name, seed), id=f"{name}-{seed}")
    for name in OTHER_SENSORS
    for seed in range(4)
]


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_what_is_wrong_with_a_sensor_that_nobody_knows_is_told(name: str, seed: int) -> None:
    sensor = OTHER_SENSORS[name]
    found = diagnose(*sensor.recordings(seed))
    assert sensor.kinds <= {cause.effect.family for cause in found.causes}
    false = {
        cause.name: cause.confidence
        for cause in found.causes
        if cause.effect.family not in sensor.kinds | sensor.beside
    }
    assert all(confidence < STANDARD.least_confidence for confidence in false.values()), false
    assert found.baseline is not None
    assert found.extended is not None
    assert found.extended.rmse <= found.baseline.rmse * (1.0 + 1e-6)
    if name in OUTSIDE:
        assert found.verdict in ("unexplained", "partly_explained")
        assert all(confidence <= 0.5 for confidence in false.values()), false
    elif sensor.kinds:
        assert found.verdict in ("explained", "partly_explained")
    else:
        assert found.verdict == "adequate"
