"""A sensor whose range ends softly behind a wall that hardens: two curves of one unit, each bends for the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach
from daily import first_and_bank

from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

SHARPNESS = 20.0


def _stopped(recording: Recording, most: float) -> Recording:
    """y = x / (1 + x^n)^(1/n) of the ``most`` that it can give, above its zero: no branch and no corner."""
    reading = recording.sensors[0]
    zero = float(np.median(reading.values[:50]))
    share = (reading.values - zero) / most
    limited = share / (1.0 + np.abs(share) ** SHARPNESS) ** (1.0 / SHARPNESS)
    return recording.with_channel(replace(reading, values=zero + most * limited))


@pytest.mark.parametrize("seed", first_and_bank((0, 2), {0}))
def test_the_end_of_a_range_is_told_beside_the_curve_before_it(seed: int) -> None:
    case = within_reach({"wall_hardening": 2.0}, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    readings = [one.sensors[0].values for one in case.recordings]
    most = 0.95 * max(float(np.max(np.abs(one - np.median(one[:50])))) for one in readings)
    fitted, held_out = ([_stopped(one, most) for one in some] for some in (case.recordings, case.hold_out))
    found = diagnose(fitted, held_out)
    assert found.verdict == "explained"
    assert {"wall_hardening", "saturation"} <= {cause.name for cause in found.causes}
    assert all(cause.confidence > 0.9 for cause in found.causes[:2])
    assert found.gain is not None
    assert found.gain.gain_percent > 80.0
