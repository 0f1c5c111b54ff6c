"""The paper's triangles on a plant that SciPy solves: data for the identifier's tests."""

from __future__ import annotations

import numpy as np
from scipy import signal

from smartshoe.models import X_OVER_NRT
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

TOE = (1.341, 0.215, 1.0)
FIXED = {"offset": 0.0, "delay": 0.0, "initial_state": "steady"}
SIX_RATES = (50.0, 100.0, 200.0, 400.0, 600.0, 800.0)


def coefficients(k1: float, k2: float, c: float) -> tuple[float, float, float]:
    """a1, b0, b1 of Chinimilli 2016 (3), (4), (14)."""
    return k2 / c, 1 + (k1 + k2) * X_OVER_NRT, k2 / c * (1 + k1 * X_OVER_NRT)


def pressed(system: tuple[list[float], list[float]], load: np.ndarray, step_s: float) -> np.ndarray:
    """The plant's reading (n,) of a load (n,) that starts from 0 and is straight between its samples, by scipy.

    What `signal.lsim` gives to rounding, which walks the samples one by one in Python: a quarter of a second a minute.
    """
    numerator, denominator, _ = signal.cont2discrete(system, step_s, method="foh")
    return np.asarray(signal.lfilter(numerator.ravel(), denominator, load))


def press(
    solid: tuple[float, float, float] = TOE,
    *,
    seed: int = 0,
    load_noise: float = 0.0,
    reading_noise: float = 0.0,
    offset: float = 0.0,
    load_offset: float = 0.0,
    delay_s: float = 0.0,
    start_s: float = 0.0,
    rates: tuple[float, ...] = (100.0, 400.0, 800.0),
    repeats: int = 2,
    rest_s: float = 2.0,
    name: str = "triangles",
    metadata: dict[str, str] | None = None,
    gap: slice | None = None,
    command: bool = False,
) -> Recording:
    """The paper's triangles at 100 Hz on a plant solved by scipy at 1 kHz."""
    a1, b0, b1 = coefficients(*solid)
    protocol = dynamic_protocol(rates, repeats=repeats, rest_s=rest_s)
    fine = np.arange(0.0, protocol.duration_s, 1e-3)
    load = protocol.load_at(fine)
    reading = pressed(([1.0, a1], [b0, b1]), load, 1e-3)
    time_s = np.arange(start_s, protocol.duration_s - 0.5, 0.01)
    rng = np.random.default_rng(seed)
    measured = np.interp(time_s - delay_s, fine, reading) + offset + reading_noise * rng.standard_normal(time_s.size)
    clean = np.interp(time_s, fine, load)
    force_n = clean + load_offset + load_noise * rng.standard_normal(time_s.size)
    if gap is not None:
        measured[gap] = np.nan
    columns = {"command_n": clean} if command else {}
    return Recording.from_arrays(
        time_s=time_s, force_n=force_n, pressure_mbar=measured, name=name, unit="left_toe", metadata=metadata, **columns
    )
