"""A machine's log is refused if it was cut short, and never if it is whole: of every protocol that may be asked for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.signal import lfilter

from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol
from smartshoe.recording import Recording
from smartshoe.runs.session._checks import Pressing, PressingFault, too_few_repeats

PEAK_N, STEP_S = 800.0, 0.02
PROTOCOLS = {
    "static": static_protocol(),
    "dynamic": dynamic_protocol(),
    "without_rests": dynamic_protocol((100.0, 800.0), repeats=3, rest_s=0.0),
    **{name: made(PEAK_N) for name, made in EXPERIMENTS.items()},
}
names = st.sampled_from(sorted(PROTOCOLS))


def _last_pressed_s(protocol: Protocol) -> float:
    """The last corner at a tenth of the protocol's peak or more."""
    corner_s, corner_n = protocol.corners()
    return float(corner_s[np.nonzero(corner_n >= 0.1 * protocol.peak_load_n)[0][-1]])


def _fault(protocol: Protocol, time_s: np.ndarray, load_n: np.ndarray) -> PressingFault | None:
    log = Recording.from_arrays(time_s=time_s, force_n=load_n, name="log")
    return too_few_repeats(Pressing("left_toe", protocol, log, log))


PLAIN = {"seed": 1, "noise": 0.002, "tare": 0.0, "gain": 1.0, "rate": 0.0, "lag_s": 0.0}


def _log(protocol: Protocol, **machine: float) -> tuple[np.ndarray, np.ndarray]:
    """A log at 50 Hz; ``noise`` and ``tare`` are shares of the peak.

    The machine's clock is fast by ``rate``, its load off by ``gain`` and late by a first-order lag of ``lag_s``.
    """
    seed, noise, tare, gain, rate, lag_s = (PLAIN | machine).values()
    rng = np.random.default_rng(int(seed))
    time_s = np.arange(rng.uniform(0.0, STEP_S), protocol.duration_s + 3.0 * lag_s, STEP_S)
    forgets = np.exp(-STEP_S / lag_s) if lag_s > 0.0 else 0.0
    pressed_n = lfilter([gain * (1.0 - forgets)], [1.0, -forgets], protocol.load_at(time_s))
    load_n = pressed_n + protocol.peak_load_n * (tare + rng.normal(0.0, noise, time_s.size))
    return (1.0 + rate) * time_s, load_n


machines = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "noise": st.floats(0.0, 0.004),
        "tare": st.floats(-0.05, 0.05),
        "gain": st.floats(0.96, 1.04),
        "rate": st.floats(-0.01, 0.01),
        "lag_s": st.floats(0.0, 0.05),
    }
)


@given(names, machines, st.floats(0.0, 1.0))
@example("multisine", {"lag_s": 0.05}, 1.0)
@example("multisine", {"noise": 0.003}, 1.0)
def test_a_whole_log_is_never_taken_for_one_cut_short(name: str, machine: dict[str, float], rest: float) -> None:
    """Whether or not the last rest, or a part of it, is in the log."""
    protocol = PROTOCOLS[name]
    time_s, load_n = _log(protocol, **machine)
    corner_s, corner_n = protocol.corners()
    unloaded_s = corner_s[np.nonzero(corner_n)[0][-1] + 1]
    end_s = unloaded_s + rest * (protocol.duration_s - unloaded_s) + 3.0 * machine.get("lag_s", 0.0) + STEP_S
    inside = time_s <= (1.0 + machine.get("rate", 0.0)) * end_s
    assert _fault(protocol, time_s[inside], load_n[inside]) is None


@given(names, machines, st.floats(0.02, 0.9999))
def test_a_log_cut_anywhere_before_the_last_press_is_over_is_refused(
    name: str, machine: dict[str, float], share: float
) -> None:
    protocol = PROTOCOLS[name]
    time_s, load_n = _log(protocol, **machine)
    inside = time_s <= (1.0 + machine["rate"]) * share * _last_pressed_s(protocol)
    found = _fault(protocol, time_s[inside], load_n[inside])
    assert found is not None
    assert found.kind == "too_few_repeats"
    assert found.says.endswith("run it to its end")


@pytest.mark.parametrize("name", ["multisine", "minor_loops", "holds_at_several_loads"])
def test_a_machine_that_unloads_where_it_stops_has_not_pressed_to_the_end(name: str) -> None:
    """A press that is given up looks whole by its end: the time under load tells it, to a twentieth."""
    protocol = PROTOCOLS[name]
    time_s, load_n = _log(protocol)
    given_up = time_s > 0.85 * _last_pressed_s(protocol)
    found = _fault(protocol, time_s, np.where(given_up, 0.0, load_n))
    assert found is not None
    assert "s in all" in found.says


def test_a_hand_set_machine_may_rest_longer_or_shorter() -> None:
    for rest_s in (2.0, 9.0):
        assert _fault(dynamic_protocol(rest_s=5.0), *_log(dynamic_protocol(rest_s=rest_s))) is None
