"""What no law of the catalogue does: a port that opens one way, a gain that recovers, a zero that jumps: told."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach
from daily import first_and_bank
from scipy.ndimage import gaussian_filter1d

from smartshoe.diagnosis import Diagnosis, diagnose
from smartshoe.recording import Recording

SHARES = 20  # of a step, in which the flap is followed by Euler's method
JUMPS = ((0.3, 0.02), (0.7, -0.015)), ((0.45, 0.012), (0.8, 0.018)), ((0.25, -0.02),), ((0.55, 0.02),), ((0.4, -0.01),)


def _through_a_flap(recording: Recording, open_s: float, shut_s: float) -> Recording:
    """The reading behind a port that fills with ``open_s`` and empties with ``shut_s``."""
    reading = recording.sensors[0]
    step_s = float(np.median(np.diff(recording.time_s))) / SHARES
    times = np.arange(recording.time_s[0], recording.time_s[-1] + 0.5 * step_s, step_s)
    behind, level = np.empty(times.size), float(reading.values[0])
    for k, before in enumerate(np.interp(times, recording.time_s, reading.values)):
        level += (before - level) * min(step_s / (open_s if before > level else shut_s), 1.0)
        behind[k] = level
    return recording.with_channel(replace(reading, values=np.interp(recording.time_s, times, behind)))


def _jumped(recording: Recording, jumps: tuple[tuple[float, float], ...]) -> Recording:
    """The reading with its zero moved at each share of the time by a share of its range."""
    reading = recording.sensors[0]
    share = (recording.time_s - recording.time_s[0]) / np.ptp(recording.time_s)
    moved = np.sum([by * (share >= at) for at, by in jumps], axis=0) * np.ptp(reading.values)
    return recording.with_channel(replace(reading, values=reading.values + moved))


def _worked(recording: Recording, lost: float, heals_s: float) -> Recording:
    """The reading of a gel with two kinds of bonds that work breaks, each by a power of its rate, and rest mends.

    ``lost``: share of the gain that goes with all bonds. The second kind mends four times as slowly; what does not mend
    (``heals_s`` infinite) breaks in as many loadings.
    """
    reading, span = recording.sensors[0], float(np.ptp(recording.sensors[0].values))
    height = (reading.values - reading.values[0]) / span
    smooth = gaussian_filter1d(height, 15)  # noise does no work
    step_s = np.diff(recording.time_s, prepend=recording.time_s[0])
    power = np.abs(np.diff(smooth**2, prepend=smooth[0] ** 2)) / np.maximum(step_s, 1e-9)  # of a spring, by the second
    gone = np.zeros(height.size)
    for share, exponent, slower in ((0.6, 0.8, 1.0), (0.4, 1.2, 4.0)):
        broken = 0.0
        for k in range(1, height.size):
            broken += step_s[k] * (0.08 * power[k] ** exponent * (1.0 - broken) - broken / (slower * heals_s))
            gone[k] += share * broken
    return recording.with_channel(replace(reading, values=reading.values[0] + span * height * (1.0 - lost * gone)))


def _sure(found: Diagnosis) -> set[str]:
    return {one.effect.family for one in found.causes if one.confidence > 0.5 and one.size > 1.5e-3} - {"zero", "tare"}


@pytest.mark.parametrize(("open_s", "shut_s"), [(0.002, 0.06), pytest.param(0.08, 0.004, marks=pytest.mark.long)])
@pytest.mark.parametrize("seed", first_and_bank([40, 41, 42], {40}))
def test_a_port_that_opens_one_way_is_told_and_no_lag_is_named_for_it(seed: int, open_s: float, shut_s: float) -> None:
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed)
    fitted, held_out = (
        [_through_a_flap(one, open_s, shut_s) for one in some] for some in (case.recordings, case.hold_out)
    )
    found = diagnose(fitted, held_out)
    assert "comes later one way than the other" in " ".join(found.limits)
    assert not _sure(found)
    assert found.verdict in ("unexplained", "partly_explained")
    assert found.gain is not None
    assert found.gain.gain_percent > 30.0
    direction = found.model.part("flexible_lag").values[1]  # type: ignore[union-attr]
    assert np.sign(direction) == np.sign(open_s - shut_s)


@pytest.mark.long
@pytest.mark.parametrize("tau_s", first_and_bank([0.02, 0.06], {0.02}))
@pytest.mark.parametrize("seed", first_and_bank([43, 44], {43}))
def test_a_port_that_is_as_slow_both_ways_is_a_lag(seed: int, tau_s: float) -> None:
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed)
    fitted, held_out = (
        [_through_a_flap(one, tau_s, tau_s) for one in some] for some in (case.recordings, case.hold_out)
    )
    found = diagnose(fitted, held_out)
    assert "timing" in _sure(found)
    assert "one way" not in " ".join(found.limits)


@pytest.mark.parametrize("heals_s", first_and_bank([8.0, 20.0], {8.0}))
@pytest.mark.parametrize("protocol", first_and_bank([*PLAIN], {"rates_and_holds"}))
@pytest.mark.parametrize("seed", first_and_bank([60, 61], {60}))
def test_a_gain_that_comes_back_at_rest_is_told_and_no_softening_is_named_for_it(
    seed: int, protocol: str, heals_s: float
) -> None:
    case = within_reach({}, protocol, seed, recordings=2)
    fitted, held_out = ([_worked(one, 0.15, heals_s) for one in some] for some in (case.recordings, case.hold_out))
    found = diagnose(fitted, held_out)
    assert "gets it back at rest" in " ".join(found.limits)
    assert not any(one.confidence > 0.5 for one in found.causes)
    assert found.gain is not None
    assert found.gain.gain_percent > 5.0  # half of what is left is noise


@pytest.mark.long
@pytest.mark.parametrize("protocol", first_and_bank([*PLAIN], {"rates_and_holds"}))
@pytest.mark.parametrize("seed", first_and_bank([62, 63], {62}))
def test_a_gain_that_stays_gone_at_rest_is_a_softening(seed: int, protocol: str) -> None:
    case = within_reach({}, protocol, seed, recordings=2)
    fitted, held_out = ([_worked(one, 0.06, np.inf) for one in some] for some in (case.recordings, case.hold_out))
    found = diagnose(fitted, held_out)
    assert {"softening", "gain_drift"} & {one.effect.family for one in found.causes if one.confidence > 0.5}
    assert "gets it back at rest" not in " ".join(found.limits)


@pytest.mark.parametrize("effects", first_and_bank([{}, {"wall_hardening": 1.0}], [{}]))
@pytest.mark.parametrize("seed", first_and_bank([50, 51, 52], {50}))
def test_zeros_that_jump_are_told_with_their_moments_and_nothing_is_sure_beside_them(
    seed: int, effects: dict[str, float]
) -> None:
    case = within_reach(effects, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    fitted = [_jumped(one, jumps) for one, jumps in zip(case.recordings, JUMPS, strict=False)]
    found = diagnose(fitted, [_jumped(one, jumps) for one, jumps in zip(case.hold_out, JUMPS[2:], strict=False)])
    (said,) = [one for one in found.limits if one.startswith("the zero jumps")]
    told = [(name, float(at)) for at, name in re.findall(r"at ([0-9.]+) s in (\w+)", said)]
    for one, jumps in zip(fitted, JUMPS, strict=False):
        for at, _ in jumps:
            at_s = one.time_s[0] + at * np.ptp(one.time_s)
            nearest = min((abs(when - at_s) for name, when in told if name == one.name), default=np.inf)
            assert nearest < 0.03 * np.ptp(one.time_s)  # two of sixty moments
    assert not _sure(found)
    assert found.extended is not None
    assert found.extended.rmse <= found.baseline.rmse * (1.0 + 1e-9)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("effects", "jumps"),
    [
        ({}, JUMPS[0]),
        ({"zero_drift": 1.0}, ()),  # what is most like a jump
        pytest.param({}, (), marks=pytest.mark.long),
        pytest.param({"zero_drift": 1.0}, JUMPS[0], marks=pytest.mark.long),
        *(
            pytest.param(effects, jumps, marks=pytest.mark.bank)
            for effects in ({"wall_hardening": 1.0}, {"linear_leak": 1.0})
            for jumps in ((), JUMPS[0])
        ),
    ],
)
@pytest.mark.parametrize("seed", first_and_bank([54, 55], {54}))
def test_jumps_of_a_single_recording_are_told_but_for_the_cycle_that_is_held_out(
    seed: int, effects: dict[str, float], jumps: tuple[tuple[float, float], ...]
) -> None:
    one = within_reach(effects, PLAIN[seed % len(PLAIN)], seed, recordings=2).recordings[0]
    found = diagnose(_jumped(one, jumps) if jumps else one)
    said = " ".join(one for one in found.limits if one.startswith("the zero jumps"))
    told = [(float(at) - one.time_s[0]) / np.ptp(one.time_s) for at in re.findall(r"at ([0-9.]+) s in", said)]
    assert bool(told) is bool(jumps)
    for at, _ in jumps:
        assert min(abs(when - at) for when in told) < 0.1
    assert not (jumps and _sure(found))
