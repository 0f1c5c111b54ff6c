"""The plain unit, by least squares: its load after some delay, at once and behind one lag, of whatever times there are.

Before any model is fitted it tells of two accounts of a load which of them a reading goes by.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.signals.lags import lagged

LAGS = 16  # resolution: lags that are tried, from a sample to the recording, and half as many delays


def delays_of(count: int) -> Index:
    """(k,) delays to try among ``count`` samples: none, and from one to an eighth of them."""
    return np.unique([0, *np.rint(np.geomspace(1, max(count // 8, 1), LAGS // 2)).astype(np.intp)])


def plain_units(load: Array, reading: Array, delays: Iterable[int]) -> Iterator[tuple[float, Array]]:
    """For each lag (in samples) and delay, that lag and (n, 3) columns: ``load`` delayed, that lagged, ``reading``.

    The load is taken as a share of its span.
    """
    load = (load - load.min()) / np.ptp(load)
    for lag, delay in product(np.geomspace(1.0, load.size, LAGS), delays):
        delayed = np.concatenate([np.full(delay, load[0]), load[: load.size - delay]])
        yield float(lag), np.stack([delayed, lagged(delayed, 1.0, float(lag)), reading], axis=1)


def without_past(columns: Array, lag: float) -> Array:
    """(n, k) ``columns`` less what an offset, a drift and a past that fades with a ``lag``, in samples, explain."""
    at = np.arange(len(columns))
    past = np.linalg.qr(np.stack([np.ones(at.size), at, np.exp(-at / lag)], axis=1))[0]
    return np.asarray(columns - past @ (past.T @ columns))


def weights_of(columns: Array) -> Array:
    """(2,) least-squares weights of the first two ``columns`` (n, 3) for the third; 0 of a load that stands."""
    normal = columns[:, :2].T @ columns
    return np.asarray(np.linalg.solve(normal[:, :2] + 1e-9 * len(columns) * np.eye(2), normal[:, 2]))


def squares_left(columns: Array, weights: Array) -> float:
    """What the unit with ``weights`` (2,) leaves of the squares of the reading in ``columns`` (n, 3)."""
    return float(np.sum((columns[:, 2] - columns[:, :2] @ weights) ** 2))
