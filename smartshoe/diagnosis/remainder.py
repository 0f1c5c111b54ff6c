"""What a model leaves over: how much of it is structure and how much noise, judged without any model of the structure.

Two looks, since an unknown effect shows in either:

*repeating*: the products of a cycle's residual with its repeats' (cycles of one rate and height). Noise of different
cycles is independent whatever its colour, so that their mean is the variance of what repeats.

*slow*: means over blocks of a few seconds against what noise of the residual's own fast part would give. A step in
gain, a wander, a random telegraph repeat with no cycle, but they do not average out within a block either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.session import Session

Array = NDArray[np.float64]

PLACES = 64  # of a cycle, when repeats are laid over each other
ALIKE = 0.1  # in height and duration


@dataclass(frozen=True, slots=True)
class Look:
    """``rms`` of the structure in shares of full scale (0 where its variance is estimated negative), and its z score."""

    rms: float
    z: float
    pairs: int


def repeating(sessions: Sequence[Session], residuals: Sequence[Array]) -> Look:
    """Structure that repeats from cycle to cycle."""
    products: list[float] = []
    spreads: list[float] = []
    for rows in repeats(sessions, residuals):
        count = rows.shape[0]
        rows = rows - 0.0
        gram = rows @ rows.T / rows.shape[1]
        upper = np.triu_indices(count, 1)
        products += list(gram[upper])
        # Spread of a product of independent noises, from the rows' own autocovariance about their mean.
        noise = rows - rows.mean(axis=0)
        scale = count / (count - 1)
        auto = np.zeros(rows.shape[1])
        for row in noise:
            full = np.correlate(row, row, "full")[rows.shape[1] - 1 :]
            auto += full / rows.shape[1]
        auto *= scale / count
        variance = (auto[0] ** 2 + 2 * np.sum((1 - np.arange(1, auto.size) / auto.size) * auto[1:] ** 2)) / rows.shape[1]
        spreads += [variance] * upper[0].size
    if not products:
        return Look(0.0, 0.0, 0)
    mean = float(np.mean(products))
    sd = float(np.sqrt(np.sum(spreads))) / len(spreads)
    return Look(float(np.sqrt(max(mean, 0.0))), mean / max(sd, 1e-300), len(products))


def repeats(sessions: Sequence[Session], residuals: Sequence[Array]) -> list[Array]:
    """The residual over each kind of load cycle: (repeats, PLACES) a kind, over the times at which all are loaded."""
    found: list[tuple[float, float, Array]] = []
    for session, residual in zip(sessions, residuals, strict=True):
        load = session.conditions.load
        for number in range(int(session.cycle[-1]) + 1):
            index = np.flatnonzero(session.cycle == number)
            part = load[index]
            peak = float(part.max())
            inside = np.flatnonzero(part > 0.1 * peak) if peak > 0.1 else np.zeros(0, dtype=int)
            if inside.size < 8:
                continue
            first, last = index[inside[0]], index[inside[-1]]
            span = slice(first, last + 1)
            if session.usable[span].mean() < 0.9:
                continue
            places = np.linspace(0, last - first, PLACES)
            row = np.interp(places, np.arange(last + 1 - first), residual[span])
            found.append((peak, (last - first) * session.conditions.step_s, row))
    kinds: list[list[tuple[float, float, Array]]] = []
    for one in found:
        for kind in kinds:
            if all(abs(a - b) <= ALIKE * abs(b) for a, b in zip(one[:2], kind[0][:2], strict=True)):
                kind.append(one)
                break
        else:
            kinds.append([one])
    return [np.stack([row for _, _, row in kind]) for kind in kinds if len(kind) > 1]


def slow(sessions: Sequence[Session], residuals: Sequence[Array], block_s: float) -> Look:
    """Structure in the means of blocks of ``block_s``, beyond what noise fitted to the faster part would leave there."""
    excess: list[float] = []
    spread = 0.0
    for session, residual in zip(sessions, residuals, strict=True):
        width = max(2, round(block_s / session.conditions.step_s))
        count = residual.size // width
        if count < 6:
            continue
        mask = session.usable[: count * width].reshape(count, width)
        rows = np.where(mask, residual[: count * width].reshape(count, width), 0.0)
        number = mask.sum(axis=1)
        good = number > width // 2
        means = rows[good].sum(axis=1) / number[good]
        expected = _mean_variance(rows[good], mask[good])
        excess += list(means**2 - expected)
        spread += 2.0 * expected**2 * means.size
    if not excess:
        return Look(0.0, 0.0, 0)
    mean = float(np.mean(excess))
    return Look(float(np.sqrt(max(mean, 0.0))), mean * len(excess) / max(np.sqrt(spread), 1e-300), len(excess))


def _mean_variance(rows: Array, mask: NDArray[np.bool_]) -> float:
    """Variance of a block's mean from the covariances within blocks, white noise and one first-order part."""
    width = rows.shape[1]
    centred = np.where(mask, rows - rows.sum(axis=1, keepdims=True) / mask.sum(axis=1, keepdims=True), 0.0)
    lags = np.arange(1, max(2, width // 3))
    c0 = float(np.median(np.sum(centred**2, axis=1) / mask.sum(axis=1)))
    auto = np.array([float(np.median(np.sum(centred[:, k:] * centred[:, :-k], axis=1))) / width for k in lags])
    # Centring takes the mean's variance v out of every covariance: c_k = r_k - v. v = (1/n)(r_0 + 2 sum r_k).
    v = 0.0
    for _ in range(50):
        total = c0 + v + 2 * float(np.sum(np.where(auto + v > 0, (1 - lags / width) * (auto + v), 0.0)))
        v = 0.5 * v + 0.5 * total / width
    return v
