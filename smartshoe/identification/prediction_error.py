"""The prediction error of the first-order model: one residual and one analytic gradient for every method.

Written for an input u and an output y, as y = p1 (u - w) + p2 w + offset + h exp(-alpha t), where w = alpha/(s +
alpha) u started in steady state. p1 is the gain at high frequency and p2 the static gain: far less correlated than
the coefficients of Chinimilli 2016 (13), which are functions of (alpha, p1, p2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from smartshoe.identification.experiment import Array, Direction, Experiment
from smartshoe.models.first_order import lag, lag_and_slope, shifted

Structure = Literal["free", "grey_box"]
LARGEST_DELAY_S = 0.5
EDGE_SAMPLES = 3  # at either end, whose delayed input lies beyond the log


@dataclass(frozen=True)
class Settings:
    """What is fitted: a float fixes a nuisance, None estimates it. ``offset`` in reading units, ``delay_s`` in s."""

    direction: Direction = "inverse"
    structure: Structure = "free"
    offset: float | None = None
    delay_s: float | None = None
    steady: bool = False
    stiffness: float = 1.0  # scale times X: newtons per reading unit and unit of k, for the grey box


class PredictionError:
    """Residual (model minus measured, kept samples only) and Jacobian over theta.

    theta = (ln alpha, p1, p2) or, in the grey box, (ln a1, static gain), then the delay where it is estimated, then
    one offset at the output and one initial state a recording where they are: all but the pole and the delay enter
    the free form linearly. ``residual`` and ``jacobian`` share one pass.
    """

    def __init__(self, experiments: Sequence[Experiment], settings: Settings) -> None:
        self.experiments, self.settings = list(experiments), settings
        self.shape_size = 3 if settings.structure == "free" else 2
        self.delay_at = self.shape_size if settings.delay_s is None else None
        at = self.shape_size + (self.delay_at is not None)
        count = len(self.experiments)
        self.offset_at = at if settings.offset is None else None
        at += count if settings.offset is None else 0
        self.state_at = at if not settings.steady else None
        self.size = at + (0 if settings.steady else count)
        self.kept: list[NDArray[np.bool_]] = [experiment.kept for experiment in self.experiments]
        if self.delay_at is not None:
            self.drop_edges(EDGE_SAMPLES)
        self._key = b""
        self._last: tuple[Array, Array] | None = None

    # -- parameters ------------------------------------------------------------------------------------------
    def shape(self, theta: Array) -> tuple[float, float, float, Array]:
        """alpha, p1, p2 and d(ln alpha, p1, p2)/d(shape parameters) (3, k)."""
        if self.settings.structure == "free":
            return float(np.exp(theta[0])), float(theta[1]), float(theta[2]), np.eye(3)
        a1, static = float(np.exp(theta[0])), float(theta[1])
        spring = self.settings.stiffness * a1
        b0 = static + spring
        if self.settings.direction == "inverse":
            return a1, b0, static, np.array([[1.0, 0.0], [spring, 1.0], [0.0, 1.0]])
        slope = np.array(
            [
                [1 - spring / b0, 1 / static - 1 / b0],
                [-spring / b0**2, -1 / b0**2],
                [0.0, -1 / static**2],
            ]
        )
        return abs(static * a1 / b0), 1 / b0, 1 / static, slope

    def coefficients(self, theta: Array) -> tuple[Array, Array]:
        """(a1, b0, b1) of Chinimilli 2016 (13) and their Jacobian (3, k) over the shape parameters."""
        if self.settings.structure == "grey_box":
            a1, static = float(np.exp(theta[0])), float(theta[1])
            spring = self.settings.stiffness * a1
            values = np.array([a1, static + spring, static * a1])
            return values, np.array([[a1, 0.0], [spring, 1.0], [static * a1, a1]])
        alpha, p1, p2 = float(np.exp(theta[0])), float(theta[1]), float(theta[2])
        if self.settings.direction == "inverse":
            return np.array([alpha, p1, p2 * alpha]), np.array([[alpha, 0, 0], [0, 1, 0], [p2 * alpha, 0, alpha]])
        a1, b0, b1 = alpha * p2 / p1, 1 / p1, alpha / p1
        slope = np.array([[a1, -a1 / p1, alpha / p1], [0.0, -b0 / p1, 0.0], [b1, -b1 / p1, 0.0]])
        return np.array([a1, b0, b1]), slope

    def delay_s(self, theta: Array) -> tuple[float, float]:
        """The delay in s (reading later than load is positive) and its slope; a sine keeps it within bounds."""
        if self.delay_at is None:
            return float(self.settings.delay_s or 0.0), 0.0
        q = float(theta[self.delay_at])
        return LARGEST_DELAY_S * float(np.sin(q / LARGEST_DELAY_S)), float(np.cos(q / LARGEST_DELAY_S))

    def offset(self, theta: Array, index: int) -> tuple[float, Array]:
        """The reading at no load of one recording, and its gradient over theta.

        An offset of the output itself in the forward direction; in the inverse one it has passed the static gain.
        """
        gradient = np.zeros(self.size)
        if self.offset_at is None:
            return float(self.settings.offset or 0.0), gradient
        at, value = self.offset_at + index, float(theta[self.offset_at + index])
        if self.settings.direction == "forward":
            gradient[at] = 1.0
            return value, gradient
        gain_at = self.shape_size - 1  # p2, and in the inverse grey box the static gain: the same number
        gain = float(theta[gain_at])
        gradient[at], gradient[gain_at] = -1.0 / gain, value / gain**2
        return -value / gain, gradient

    def drop_edges(self, count: int) -> None:
        """Leave ``count`` samples at either end of every recording out of the error."""
        self._key = b""
        for index, experiment in enumerate(self.experiments):
            kept = experiment.kept.copy()
            if kept.size > 4 * count:
                kept[:count] = False
                kept[kept.size - count :] = False
            self.kept[index] = kept

    # -- the error -------------------------------------------------------------------------------------------
    def residual(self, theta: Array) -> Array:
        """(m,) model minus measured, in N (inverse) or reading units (forward)."""
        return self._evaluate(theta)[0]

    def jacobian(self, theta: Array) -> Array:
        """(m, size) derivative of `residual`."""
        return self._evaluate(theta)[1]

    def _evaluate(self, theta: Array) -> tuple[Array, Array]:
        key = theta.tobytes()
        if key == self._key and self._last is not None:
            return self._last
        sizes = [int(np.count_nonzero(kept)) for kept in self.kept]
        residual = np.empty(sum(sizes))
        jacobian = np.zeros((residual.size, self.size), order="F")
        at = 0
        for index, size in enumerate(sizes):
            rows = slice(at, at + size)
            error, slopes = self._one(theta, index, with_slopes=True)
            kept = self.kept[index]
            residual[rows] = error[kept]
            for column, slope in slopes.items():
                jacobian[rows, column] = slope[kept] if isinstance(slope, np.ndarray) else slope
            at += size
        self._key, self._last = key, (residual, jacobian)
        return self._last

    def model_error(self, theta: Array, index: int) -> Array:
        """(n,) model minus measured of one recording at every sample, missing ones too."""
        return self._one(theta, index, with_slopes=False)[0]

    def _one(self, theta: Array, index: int, *, with_slopes: bool) -> tuple[Array, dict[int, Array | float]]:
        experiment = self.experiments[index]
        inverse = self.settings.direction == "inverse"
        u, y = experiment.signals(self.settings.direction)
        alpha, p1, p2, to_shape = self.shape(theta)
        delay_s, delay_slope = self.delay_s(theta)
        sign = 1.0 if inverse else -1.0
        u_slope = None
        if self.delay_at is not None or delay_s != 0.0:
            u, u_slope = shifted(u, experiment.time_s, experiment.step, sign * delay_s)
        w, w_slope = (
            lag_and_slope(u, alpha, experiment.step) if with_slopes else (lag(u, alpha, experiment.step), np.empty(0))
        )
        zero = float(self.settings.offset or 0.0)
        fade = np.exp(-alpha * experiment.time_s)
        state = 0.0 if self.state_at is None else float(theta[self.state_at + index])
        # A fixed offset is the reading's: it passes the static gain where the reading is the input.
        error = p1 * (u - w) + p2 * (w - zero if inverse else w) + state * fade - y
        if self.offset_at is not None:
            error += float(theta[self.offset_at + index])
        elif not inverse:
            error += zero
        if not with_slopes:
            return error, {}
        shape = np.stack(
            [
                alpha * ((p2 - p1) * w_slope - state * experiment.time_s * fade),
                u - w,
                w - zero if inverse else w,
            ]
        )
        slopes: dict[int, Array | float] = dict(enumerate(to_shape.T @ shape))
        if self.delay_at is not None and u_slope is not None:
            slow = lag(u_slope, alpha, experiment.step)
            slopes[self.delay_at] = (sign * delay_slope) * (p1 * (u_slope - slow) + p2 * slow)
        if self.offset_at is not None:
            slopes[self.offset_at + index] = 1.0
        if self.state_at is not None:
            slopes[self.state_at + index] = fade
        return error, slopes
