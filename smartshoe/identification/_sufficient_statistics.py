"""Sufficient statistics of the first-order model for every relaxation time, and the minimum of the cost over them.

The prediction error is linear in the input, its lag w(alpha), a constant and the initial transient exp(-alpha t). Lag
and transient are analytic in ln alpha, up to pi/2 off the real axis, so that at any alpha they equal, to some 1e-9, a
fixed combination of those at a few neighbours in a fixed bank of poles. The triangular factor of a QR decomposition
over the bank's columns (the square-root information filter: Bierman 1977, Factorization Methods for Discrete Sequential
Estimation, ch. IV) is therefore a sufficient statistic for every alpha. Variable projection (Golub and Pereyra 1973,
SIAM J. Numer. Anal. 10, 413-432) on it finds the minimiser over all samples so far. The factor is used rather than the
normal matrix because its rounding is 1e-16 of the signal, not of the signal's square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Integers
from smartshoe.errors import NotConvergedError

SLOWEST, FASTEST = 0.003, 300.0  # 1/s, the ends of the bank
POLES = 64
NEIGHBOURS = 24
VANISHED = 46.0  # exp(-46) is below rounding of 1
MOST_HALVINGS = 30

LN_POLES = np.linspace(np.log(FASTEST), np.log(SLOWEST), POLES)  # fastest first: see `Sums.absorb`
BANK = np.exp(LN_POLES)
GRID = np.append(LN_POLES[::-2], LN_POLES[0])  # increasing; where the search for the least cost begins


def bank_weights(ln_alpha: float) -> tuple[Array, Array]:
    """Weights (POLES,) that interpolate the bank's columns at ``ln_alpha``, and their derivative.

    By Lagrange's polynomial through the nearest NEIGHBOURS poles.
    """
    place = (ln_alpha - LN_POLES[0]) / (LN_POLES[1] - LN_POLES[0])
    first = int(np.clip(np.floor(place) - NEIGHBOURS // 2 + 1, 0, POLES - NEIGHBOURS))
    nodes = np.arange(NEIGHBOURS, dtype=float)
    apart = nodes[:, None] - nodes + np.eye(NEIGHBOURS)
    factors = (place - first - nodes) / apart
    np.fill_diagonal(factors, 1.0)
    # The product rule: axis 1 is the factor that is differentiated.
    products = np.repeat(factors[:, None, :], NEIGHBOURS, axis=1)
    own = np.arange(NEIGHBOURS)
    products[:, own, own] = 1.0 / apart
    slopes = products.prod(axis=2)
    np.fill_diagonal(slopes, 0.0)
    weights, derivative = np.zeros(POLES), np.zeros(POLES)
    weights[first : first + NEIGHBOURS] = factors.prod(axis=1)
    derivative[first : first + NEIGHBOURS] = slopes.sum(axis=1) / (LN_POLES[1] - LN_POLES[0])
    return weights, derivative


@dataclass
class Sums:
    """The sufficient statistics of one experiment; their size does not depend on its length.

    ``root`` (r, c) is upper triangular over the columns: the initial transients (fastest first), the lags, the input,
    the constant, the output. ``lags`` (POLES,) is the bank's state after the input ``last_u`` at sample ``last_at``.
    """

    root: Array
    lags: Array
    last_u: float = 0.0
    last_at: int = -1
    count: int = 0
    mean: float = 0.0
    squares: float = 0.0
    lowest_load: float = np.inf
    highest_load: float = -np.inf
    rise: float = 0.0
    fall: float = 0.0
    reading_ends: tuple[float, float] = (np.inf, -np.inf)

    def absorb(self, u: Array, y: Array, at: Integers, step_s: float, free: Columns, inverse: bool) -> None:
        """Add inputs (n,) at the samples ``at`` (n,); outputs (n,) are NaN where missing."""
        from smartshoe.kernels.pole_bank import lag_bank

        if not u.size:
            return
        if self.last_at < 0:  # started in the steady state of the first input
            self.lags[:] = u[0]
            self.last_u, self.last_at = float(u[0]), int(at[0]) - 1
        columns = np.empty((u.size, free.columns))
        lags = np.empty((u.size, POLES))
        lag_bank(u, at, BANK, step_s, self.last_u, self.last_at, self.lags, lags)
        self.last_u, self.last_at = float(u[-1]), int(at[-1])
        columns[:, free.lags] = lags
        columns[:, free.u], columns[:, -1] = u, y
        if free.constant is not None:
            columns[:, free.constant] = 1.0
        gone = 0
        if free.starts is not None:
            time_s = step_s * at
            # Transients that have decayed below rounding are 0: their rows of the factor do not change.
            gone = int(np.count_nonzero(time_s[0] * BANK > VANISHED))
            columns[:, :gone] = 0.0
            columns[:, gone:POLES] = np.exp(-np.outer(time_s, BANK[gone:]))
        mask = np.isfinite(y)
        if not mask.all():
            columns, u, y = columns[mask], u[mask], y[mask]
        if not y.size:
            return
        gone = min(gone, self.root.shape[0])
        update: Array = np.linalg.qr(  # type: ignore[assignment]  # mode "r" returns the factor alone
            np.concatenate([self.root[gone:, gone:], columns[:, gone:]]), mode="r"
        )
        root = np.zeros((gone + update.shape[0], free.columns))
        root[:gone], root[gone:, gone:] = self.root[:gone], update
        self.root = root
        self._watch(y if inverse else u, u if inverse else y, y)

    def _watch(self, load: Array, reading: Array, y: Array) -> None:
        lowest = np.minimum(np.minimum.accumulate(load), self.lowest_load)
        highest = np.maximum(np.maximum.accumulate(load), self.highest_load)
        self.rise = max(self.rise, float(np.max(load - lowest)))
        self.fall = max(self.fall, float(np.max(highest - load)))
        self.lowest_load, self.highest_load = float(lowest[-1]), float(highest[-1])
        low, high = self.reading_ends
        self.reading_ends = (min(low, float(reading.min())), max(high, float(reading.max())))
        self.count, self.mean, self.squares = pooled(
            (self.count, self.mean, self.squares), (y.size, float(y.mean()), float(np.sum((y - y.mean()) ** 2)))
        )


def pooled(one: tuple[int, float, float], other: tuple[int, float, float]) -> tuple[int, float, float]:
    """Count, mean and sum of squares about the mean of two sets combined."""
    count = one[0] + other[0]
    if not count:
        return one
    apart = other[1] - one[1]
    return count, one[1] + apart * other[0] / count, one[2] + other[2] + apart**2 * one[0] * other[0] / count


@dataclass(frozen=True)
class Columns:
    """Positions of the columns; ``starts`` and ``constant`` are None where they are not estimated."""

    starts: slice | None
    lags: slice
    u: int
    constant: int | None
    columns: int

    @classmethod
    def of(cls, start: bool, constant: bool) -> Columns:
        """The positions for an initial state (``start``) and a constant, each estimated or not."""
        at = POLES if start else 0
        u = at + POLES
        return cls(slice(0, POLES) if start else None, slice(at, u), u, u + 1 if constant else None, u + 2 + constant)


@dataclass(frozen=True)
class Solved:
    """The minimum: theta (p,), the Jacobian's triangular factor (p, p) there, the cost e'e, and the iterations."""

    theta: Array
    jacobian: Array
    cost: float
    iterations: int


class Projection:
    """The cost as a function of ln alpha alone, minimised over all else, from the experiments' triangular factors.

    theta = (ln alpha, p1, p2), then for each experiment one constant and one initial state where they are estimated.
    """

    def __init__(self, roots: list[Array], free: Columns) -> None:
        self.roots, self.free = roots, free
        count = len(roots)
        self.rows = np.cumsum([0, *(root.shape[0] for root in roots)])
        self.y = np.concatenate([root[:, -1] for root in roots])
        self.u = np.concatenate([root[:, free.u] for root in roots])
        self.lags = np.concatenate([root[:, free.lags] for root in roots])
        self.starts = None if free.starts is None else np.concatenate([root[:, free.starts] for root in roots])
        self.constant_at = 3 if free.constant is not None else None
        self.state_at = None if free.starts is None else 3 + count * (free.constant is not None)
        self.size = 3 + count * ((free.constant is not None) + (free.starts is not None))

    def _columns(self, weights: Array) -> Array:
        """(rows, size) derivative over theta; the first column is left 0."""
        columns = np.zeros((self.y.size, self.size))
        w = self.lags @ weights
        columns[:, 1], columns[:, 2] = self.u - w, w
        fade = None if self.starts is None else self.starts @ weights
        for index, root in enumerate(self.roots):
            own = slice(self.rows[index], self.rows[index + 1])
            if self.constant_at is not None and self.free.constant is not None:
                columns[own, self.constant_at + index] = root[:, self.free.constant]
            if self.state_at is not None and fade is not None:
                columns[own, self.state_at + index] = fade[own]
        return columns

    def solve(self, ln_alpha: float) -> tuple[Array, Array, Array]:
        """theta, the error (rows,) and its derivative (rows, size) at ``ln_alpha`` with all else optimal."""
        weights, slopes = bank_weights(ln_alpha)
        jacobian = self._columns(weights)
        scale = np.linalg.norm(jacobian[:, 1:], axis=0)
        scale = np.where(scale > 0, scale, 1.0)
        solution = np.linalg.lstsq(jacobian[:, 1:] / scale, self.y, rcond=1e-13)[0] / scale
        theta = np.concatenate([[ln_alpha], solution])
        error = jacobian[:, 1:] @ solution - self.y
        jacobian[:, 0] = (theta[2] - theta[1]) * (self.lags @ slopes)
        if self.starts is not None and self.state_at is not None:
            states = np.repeat(theta[self.state_at :], np.diff(self.rows))
            jacobian[:, 0] += states * (self.starts @ slopes)
        return theta, error, jacobian

    def slope(self, ln_alpha: float) -> float:
        """Half the derivative of the least cost over ln alpha; the other unknowns, being optimal, do not contribute."""
        _, error, jacobian = self.solve(ln_alpha)
        return float(jacobian[:, 0] @ error)

    def minimise(self, where: str) -> Solved:
        """The zero of the slope next to the best of the bank's poles; the bank's end where the cost falls towards it.

        Raises `NotConvergedError` where there is no such zero.
        """
        from scipy.optimize import brentq

        costs = []
        for ln_alpha in GRID:
            error = self.solve(float(ln_alpha))[1]
            costs.append(float(error @ error))
        best = int(np.argmin(costs))
        near = float(GRID[best])
        slope = self.slope(near)
        beyond = best + (1 if slope < 0.0 else -1)
        calls = GRID.size
        if slope != 0.0 and 0 <= beyond < GRID.size:
            far = float(GRID[beyond])
            for _ in range(MOST_HALVINGS):
                if self.slope(far) * slope < 0.0:
                    break
                far = 0.5 * (near + far)
            else:
                raise NotConvergedError(f"{where}: the cost has no least value near a pole of {np.exp(near):.3g} 1/s")
            near, found = brentq(self.slope, near, far, xtol=1e-13, rtol=1e-13, full_output=True)
            calls += found.function_calls
        theta, error, jacobian = self.solve(float(near))
        return Solved(theta, jacobian, float(error @ error), calls)
