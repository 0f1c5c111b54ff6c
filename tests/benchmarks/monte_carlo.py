"""Monte Carlo runs over the cores, and what they say of a parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from joblib import Parallel, delayed


def over_cores(function: Callable[..., np.ndarray], case: Any, runs: int, *arguments: Any) -> np.ndarray:
    """``function(case, seeds, *arguments)`` for seeds 0 .. ``runs`` - 1 split over processes, its rows joined."""
    parts = np.array_split(np.arange(runs), 16)
    done = Parallel(n_jobs=-1)(
        delayed(function)(case, [int(seed) for seed in part], *arguments) for part in parts if part.size
    )
    return np.concatenate(done)


def percent(values: np.ndarray, true: np.ndarray | float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bias, its Monte Carlo error, and standard deviation, in % of ``true``."""
    sd = values.std(axis=0, ddof=1) / np.abs(true) * 100
    return (values.mean(axis=0) / true - 1) * 100, sd / np.sqrt(values.shape[0]), sd
