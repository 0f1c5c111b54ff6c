"""Clean physics of any shape is no fault of the data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.provider import provider
from smartshoe.errors import InputError
from smartshoe.integrity import examine
from smartshoe.protocol import Protocol, Segment, dynamic_protocol, static_protocol
from smartshoe.recording import Recording

Array = NDArray[np.float64]

BLADDERS = st.one_of(
    st.just({}),
    st.builds(lambda s, w: {"hysteresis": {"strength": s, "half_width_n": w}}, st.floats(0.002, 0.1), st.floats(5, 80)),
    st.builds(lambda x: {"leak": {"linear_per_s": 10**x}}, st.floats(-4, -1)),
    st.builds(lambda x: {"leak": {"orifice_per_s": 10**x}}, st.floats(-4.5, -2)),
    st.builds(
        lambda f, x: {"gas_heat": {"fraction": f, "time_constant_s": 10**x}}, st.floats(0.1, 1), st.floats(-1, 1)
    ),
    st.builds(lambda x: {"softening": {"strength": x}}, st.floats(0.01, 0.5)),
    st.builds(lambda x: {"conditioning": {"gain": x}}, st.floats(-0.2, 0.2)),
    st.builds(lambda x: {"static_exponent": x}, st.floats(0.5, 2.5)),
    st.builds(lambda x: {"wall_hardening": x}, st.floats(-0.2, 5)),
    st.builds(lambda x: {"temperature": {"drift_k_per_s": x, "warming_k": -50 * x}}, st.floats(-0.02, 0.02)),
)
STEPS = Protocol(
    "steps",
    tuple(
        segment
        for load_n, ramp_s, hold_s in ((300.0, 0.02, 3.0), (800.0, 0.5, 6.0), (0.0, 0.1, 5.0), (550.0, 1.0, 2.0)) * 2
        for segment in (Segment("ramp", load_n, ramp_s), Segment("hold", load_n, hold_s))
    ),
)
PROTOCOLS = (
    static_protocol((100.0, 450.0, 800.0)),
    dynamic_protocol(),
    dynamic_protocol((200.0, 800.0), repeats=3, rest_s=0.0),
    STEPS,
)


def simulated(protocol: Protocol, seed: int, *, bladder=None, sensor=None, daq=None, **machine) -> Recording:
    """A unit of the simulators, pressed."""
    options = {"bladder": bladder or {}, "sensor": sensor or {}, "daq": daq or {}, **machine}
    with provider.open_machine("instron", options, np.random.default_rng(seed)) as opened:
        return opened.run(protocol)


def low_pass(signal: Array, rate_hz: float, tau_s: float) -> Array:
    """A first-order lag that starts at rest."""
    keep = float(np.exp(-1.0 / (rate_hz * tau_s)))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], signal, zi=[keep * signal[0]])[0])


def play(signal: Array, width: float) -> Array:
    """Rate-independent friction: the play operator."""
    out, state = np.empty_like(signal), float(signal[0])
    for k, value in enumerate(signal):
        state = min(max(state, value - width), value + width)
        out[k] = state
    return out


SHAPES = {
    "triangles": lambda t: np.interp(t, *dynamic_protocol((100.0, 800.0), repeats=2).corners()) / 800.0,
    "staircase": lambda t: np.interp(t, *static_protocol((200.0, 800.0)).corners()) / 800.0,
    "multisine": lambda t: 0.5 + sum(0.12 * np.sin(2 * np.pi * f * t + 9 * f) for f in (0.11, 0.43, 1.3, 3.9)),
    "steps": lambda t: np.array([0.0, 0.7, 0.2, 1.0, 0.4, 0.0, 0.9, 0.1])[(t // 8.3).astype(int) % 8],
    "gait": lambda t: np.maximum(np.sin(2 * np.pi * 0.9 * t), 0.0),
    "haversine": lambda t: 0.5 - 0.5 * np.cos(2 * np.pi * 0.07 * t),
}
PHYSICS = {
    "linear": lambda g, t, x: g,
    "relaxation": lambda g, t, x: 0.8 * g + 0.2 * low_pass(g, 1 / (t[1] - t[0]), 0.3 + 20 * x),
    "leak": lambda g, t, x: g - 0.3 * x * low_pass(g, 1 / (t[1] - t[0]), 10.0 + 40 * x),
    "friction": lambda g, t, x: play(g, 0.002 + 0.08 * x),
    "dead band": lambda g, t, x: np.maximum(g - 0.005 - 0.1 * x, 0.0),
    "soft dead band": lambda g, t, x: 0.01 * np.logaddexp(0.0, (g - 0.1 * x) / 0.01),
    "delay": lambda g, t, x: np.interp(t - 2 * x * (t[1] - t[0]), t, g),
    "sensor lag": lambda g, t, x: low_pass(g, 1 / (t[1] - t[0]), 0.003 + 0.2 * x),
    "drift": lambda g, t, x: g + 0.1 * x * t / t[-1] + 0.03 * (1 - np.exp(-t / 20)),
    "saturating contact": lambda g, t, x: g / (1.0 + 2.0 * x * g),
    "odd curve": lambda g, t, x: g + 0.3 * x * (g**3 - g),
    "softening": lambda g, t, x: g * (1 - 0.2 * x * np.tanh(5 * (np.maximum.accumulate(g) ** 2 - g**2))),
    "permanent set": lambda g, t, x: g + 0.05 * x * np.cumsum(g) / g.size,
}


@settings(max_examples=25)
@given(
    bladder=BLADDERS,
    protocol=st.sampled_from(PROTOCOLS),
    noise_percent=st.sampled_from([0.0, 0.005, 0.05, 0.3]),
    load_noise_n=st.sampled_from([0.0, 0.3, 2.23]),
    bits=st.sampled_from([12, 16, 24]),
    rate_hz=st.sampled_from([50.0, 100.0, 200.0, 500.0]),
    corner_s=st.sampled_from([0.0, 0.04]),
    lag_s=st.sampled_from([0.0, 0.001, 0.1]),
    seed=st.integers(0, 999),
)
def test_a_simulated_unit_has_no_faults(
    bladder, protocol, noise_percent, load_noise_n, bits, rate_hz, corner_s, lag_s, seed
):
    recording = simulated(
        protocol,
        seed,
        bladder=bladder,
        sensor={"noise_percent": noise_percent, "lag_s": lag_s},
        daq={"bits": bits, "sample_rate_hz": rate_hz},
        load_noise_n=load_noise_n,
        corner_s=corner_s,
    )
    found = examine([recording])
    assert found.faults == ()
    assert found.refusals == ()
    assert found.usable[0].all()
    assert found.clock_offset_s == (0.0,)


@settings(max_examples=40)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    physics=st.sampled_from(sorted(PHYSICS)),
    size=st.floats(0.0, 1.0),
    noise=st.sampled_from([0.0, 1e-5, 0.0005, 0.003]),
    load_noise_n=st.sampled_from([0.0, 0.3]),
    bits=st.sampled_from([0, 12, 16]),
    rate_hz=st.sampled_from([50.0, 100.0, 200.0]),
    seed=st.integers(0, 999),
)
def test_an_ideal_unit_of_other_equations_has_no_faults(shape, physics, size, noise, load_noise_n, bits, rate_hz, seed):
    rng = np.random.default_rng(seed)
    t = np.arange(int(66.0 * rate_hz)) / rate_hz
    load = SHAPES[shape](t)
    reading = PHYSICS[physics](load, t, size) + noise * rng.standard_normal(t.size)
    if bits:
        reading = np.rint(reading * 0.9 * 2**bits) / (0.9 * 2**bits)
    force_n = 800.0 * load + load_noise_n * rng.standard_normal(t.size)
    found = examine([Recording.from_arrays(time_s=t, force_n=force_n, pressure_mbar=100.0 * reading)])
    assert found.faults == ()
    assert found.refusals == ()


def test_finds_the_same_twice():
    recording = simulated(dynamic_protocol(), 3)
    first, second = examine([recording, recording]), examine([recording, recording])
    assert first.faults == second.faults
    assert all(np.array_equal(a, b) for a, b in zip(first.usable, second.usable, strict=True))


def test_no_recording_is_an_error():
    with pytest.raises(InputError, match="give at least one file"):
        examine([])
