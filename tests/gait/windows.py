"""Windows of a trial that are written down: contacts, strides, feet and their series, with what is asked of them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from smartshoe.gait import Contacts
from smartshoe.gait._strides import Stride
from smartshoe.gait._total import TotalForce
from smartshoe.gait._window import AnalysisWindow

NAN = float("nan")
RATE_HZ = 100.0
TIME_S = np.arange(2001) / RATE_HZ  # 0 to 20 s


def contacts(strike_s: Any = (), off_s: Any = (), floors: Any = (), regions: tuple[str, ...] = ("toe",)) -> Contacts:
    once = np.full((len(strike_s), len(regions)), NAN)
    floor = np.array(floors, dtype=float).reshape(-1, len(regions))
    return Contacts(regions, np.array(strike_s), np.array(off_s), once, once, np.arange(float(len(floor))), floor)


def stride(start_s: float, lasts_s: float = 1.0, foot: str = "left", **more: Any) -> Stride:
    end_s, off_s = start_s + lasts_s, start_s + 0.6 * lasts_s
    return replace(Stride(foot, start_s, end_s, off_s, None, None, 60.0, None, None, None, False, False), **more)


def foot(gain_sds: tuple[float, ...] = (0.0,), is_force: bool = True, rate_hz: float = RATE_HZ) -> Any:
    return SimpleNamespace(units=[SimpleNamespace(gain_sd=sd) for sd in gain_sds], is_force=is_force, rate_hz=rate_hz)


def series(load: Any, state: Any = 1, missing: Any = False, time_s: np.ndarray = TIME_S, **more: Any) -> Any:
    load = np.array(np.broadcast_to(load, (time_s.size, np.size(load) if np.ndim(load) < 2 else np.shape(load)[1])))
    shaped = {"state": np.broadcast_to(state, time_s.shape), "missing": np.broadcast_to(missing, time_s.shape)}
    usual = {"time_s": time_s, "load": load, "contacts": contacts(), "abnormality": 0.0 * time_s}
    return SimpleNamespace(**usual | shaped | more)


def window(
    made: Any, total_n: Any = None, strides: Any = (), spans: Any = (), start_s: float = -np.inf,
    end_s: float = np.inf, missing: Any = False, loaded: Any = None, time_s: np.ndarray = TIME_S,
) -> AnalysisWindow:  # fmt: skip
    """A window of feet whose ``made`` series are all that is asked of them."""
    total = None
    if total_n is not None:
        gone = np.array(np.broadcast_to(missing, time_s.shape))
        total = TotalForce(time_s, np.array(np.broadcast_to(total_n, time_s.shape), dtype=float), gone)
    return AnalysisWindow(start_s, end_s, made, made, tuple(strides), tuple(spans), loaded or {}, total, ())


BOTH = {"left": series(300.0), "right": series(300.0)}
