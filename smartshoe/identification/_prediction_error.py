"""The prediction error of the first-order model: one residual and one analytic gradient for every method.

For an input u the output is y = p1 (u - w) + p2 w + offset + h exp(-alpha t), where w = alpha/(s + alpha) u starts in
steady state. `PredictionError.evaluate`, `model_error` and `model_error_and_slopes` make one compiled pass over the
data; `residual`, `jacobian` and `error_and_slopes`, made of plain filters, are their slow twins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.identification._experiment import Direction, Experiment, whole_blocks
from smartshoe.identification._parametrisation import FreeForm, Parametrisation, Shape
from smartshoe.identification._solve import Evaluation
from smartshoe.identification._whitening import Whitening, whiten, whitening
from smartshoe.models.first_order import (
    HALF_WIDTH,
    as_kernels_take,
    interpolation_gain,
    lag,
    lag_and_slope,
    shifted,
)

LARGEST_DELAY_S = 0.5
EDGE_SAMPLES = HALF_WIDTH  # left out at either end, where the delayed input lies outside the log
COARSEST_STEP_S = 0.05
IMPULSE_SAMPLES = 2048
MOST_NOISE = 0.99  # largest share of noise in the gradient's inner products, in any direction of theta
NONE = np.zeros(0)
EVERY = np.zeros(0, dtype=bool)
NOT_STORED = np.zeros((0, 0))


@dataclass(frozen=True)
class Settings:
    """What is fitted: a number fixes a nuisance parameter, None estimates it.

    ``offset`` in reading units, ``delay_s`` in s. ``load_offset_n`` is the load's own zero; the single free constant at
    the output represents either. ``noise_ratio`` is the variance of the input's noise over that of the output's (0:
    only the output is noisy).
    """

    direction: Direction = "inverse"
    offset: float | None = None
    load_offset_n: float = 0.0
    free_constant: bool = True
    delay_s: float | None = None
    steady: bool = False
    noise_ratio: float = 0.0


class PredictionError:
    """Residual (model minus measured, counted samples only), whitened where the input is noisy too.

    theta holds the parametrisation's unknowns, then the delay in s where it is estimated, then for each recording one
    constant at the output and one initial state where they are estimated. In the free form all but the pole and the
    delay enter linearly.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        settings: Settings,
        form: Parametrisation | None = None,
        masks: Sequence[Mask] | None = None,
    ) -> None:
        self.experiments, self.settings = list(experiments), settings
        self.form: Parametrisation = form or FreeForm(settings.direction)
        self.shape_size = self.form.size
        self.delay_at = self.shape_size if settings.delay_s is None else None
        at = self.shape_size + (self.delay_at is not None)
        count = len(self.experiments)
        self.offset_at = at if settings.free_constant else None
        at += count if settings.free_constant else 0
        self.state_at = at if not settings.steady else None
        self.size = at + (0 if settings.steady else count)
        low, high = self.form.bounds()
        self.lower, self.upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        self.lower[: self.shape_size], self.upper[: self.shape_size] = low, high
        if self.delay_at is not None:
            self.lower[self.delay_at], self.upper[self.delay_at] = -LARGEST_DELAY_S, LARGEST_DELAY_S
        self.masks: list[Mask] = list(masks or [experiment.mask for experiment in self.experiments])
        if self.delay_at is not None and masks is None:
            self.drop_edges(EDGE_SAMPLES)
        self._pairs = [self._signals(experiment) for experiment in self.experiments]
        from smartshoe.kernels.first_order import COLUMNS

        # Maps the columns of a recording's pass to theta and the error; each recording has its own constant and state.
        self._columns = [np.zeros((COLUMNS, self.size + 1)) for _ in self.experiments]
        for index, own in enumerate(self._columns):
            own[-1, -1] = 1.0
            for column, place in ((3, self.delay_at), (4, self.offset_at), (5, self.state_at)):
                if place is not None:
                    own[column, place if column == 3 else place + index] = 1.0
        self._coarse: PredictionError | None = None
        self._delayed: tuple[float, list[tuple[Array, Array]]] | None = None

    def _signals(self, experiment: Experiment) -> tuple[Array, Array]:
        """Input and output, less their fixed zeros."""
        load = experiment.load_n - self.settings.load_offset_n if self.settings.load_offset_n else experiment.load_n
        zero = self.settings.offset or 0.0
        reading = experiment.reading - zero if zero else experiment.reading
        return (reading, load) if self.settings.direction == "inverse" else (load, reading)

    # -- parameters ------------------------------------------------------------------------------------------
    def shape(self, theta: Array) -> Shape:
        """The response (alpha, p1, p2) at ``theta``, with its derivative."""
        return self.form.shape(theta[: self.shape_size])

    def coefficients(self, theta: Array) -> tuple[Array, Array]:
        """(a1, b0, b1) of Chinimilli 2016 (13) and their Jacobian (3, shape_size)."""
        return self.form.coefficients(theta[: self.shape_size])

    def delay_s(self, theta: Array) -> float:
        """The delay in s; positive where the reading is later than the load."""
        return float(self.settings.delay_s or 0.0) if self.delay_at is None else float(theta[self.delay_at])

    def constant(self, theta: Array, index: int) -> float:
        """The free constant at the output of one recording; 0 where it has none."""
        return 0.0 if self.offset_at is None else float(theta[self.offset_at + index])

    def state(self, theta: Array, index: int) -> float:
        """The coefficient of the decaying initial transient of one recording."""
        return 0.0 if self.state_at is None else float(theta[self.state_at + index])

    def drop_edges(self, count: int) -> None:
        """Exclude ``count`` samples at either end of every recording from the error."""
        for index, experiment in enumerate(self.experiments):
            mask = experiment.mask.copy()
            if mask.size > 4 * count:
                mask[:count] = False
                mask[mask.size - count :] = False
            self.masks[index] = mask

    @property
    def count(self) -> int:
        """The number of counted samples."""
        return sum(int(np.count_nonzero(mask)) for mask in self.masks)

    # -- signals ---------------------------------------------------------------------------------------------
    @property
    def outputs(self) -> list[Array]:
        """For each recording the output (n,), less fixed zeros."""
        return [y for _, y in self._pairs]

    def inputs_at(self, delay_s: float) -> list[Array]:
        """For each recording the input (n,), shifted to compensate ``delay_s``."""
        if delay_s == 0.0:
            return [u for u, _ in self._pairs]
        sign = 1.0 if self.settings.direction == "inverse" else -1.0
        return [
            shifted(u, experiment.time_s, experiment.step, sign * delay_s)[0]
            for (u, _), experiment in zip(self._pairs, self.experiments, strict=True)
        ]

    def coarse(self, most: int) -> PredictionError:
        """This problem on means of neighbouring samples, about ``most`` of them; itself where it is small already."""
        total = sum(experiment.time_s.size for experiment in self.experiments)
        step_s = max(experiment.sample_time_s for experiment in self.experiments)
        factor = min(max(total // most, 1), max(int(COARSEST_STEP_S / step_s), 1))
        if self._coarse is None:
            self._coarse = self.thinned(factor)
        return self._coarse

    def with_noise_ratio(self, ratio: float) -> PredictionError:
        """This problem with input noise allowed for."""
        return PredictionError(self.experiments, replace(self.settings, noise_ratio=ratio), self.form, self.masks)

    def thinned(self, factor: int) -> PredictionError:
        """This problem on means of ``factor`` neighbouring samples."""
        if factor == 1:
            return self
        few = [experiment.decimated(factor) for experiment in self.experiments]
        masks = [
            mask if thin is experiment else whole_blocks(mask, factor)
            for mask, thin, experiment in zip(self.masks, few, self.experiments, strict=True)
        ]
        return PredictionError(few, self.settings, self.form, masks)

    def delayed(self, theta: Array) -> list[tuple[Array, Array]]:
        """For each recording the delayed input and its derivative over the delay (empty where that is fixed)."""
        delay_s = self.delay_s(theta)
        if self._delayed is not None and self._delayed[0] == delay_s:
            return self._delayed[1]
        sign = 1.0 if self.settings.direction == "inverse" else -1.0
        if self.delay_at is None and delay_s == 0.0:
            found = [(u, NONE) for u, _ in self._pairs]
        else:
            found = []
            for (u, _), experiment in zip(self._pairs, self.experiments, strict=True):
                value, slope = shifted(u, experiment.time_s, experiment.step, sign * delay_s)
                found.append((value, NONE if self.delay_at is None else slope if sign > 0 else -slope))
        self._delayed = (delay_s, found)
        return found

    # -- the error in one compiled pass ------------------------------------------------------------------------
    def evaluate(self, theta: Array) -> Evaluation:
        """Cost, gradient and normal matrix at ``theta``, without storing the residual."""
        if self.settings.noise_ratio:
            return self._evaluate_plainly(theta)
        sums, shape = np.zeros((self.size + 1, self.size + 1)), self.shape(theta)
        for index in range(len(self.experiments)):
            own = self._to_theta(shape, index)
            sums += own.T @ self._pass(theta, shape, index, NOT_STORED) @ own
        return Evaluation(float(sums[-1, -1]), sums[:-1, -1], sums[:-1, :-1], self.count)

    def _to_theta(self, shape: Shape, index: int) -> Array:
        """(COLUMNS, size + 1) matrix that maps the columns of one recording's pass to theta and the error."""
        own = self._columns[index].copy()
        own[:3, : self.shape_size] = shape.slope
        return own

    def _pass(self, theta: Array, shape: Shape, index: int, stored: Array) -> Array:
        """`inner_products` (COLUMNS, COLUMNS) of one recording at ``theta``; writes its columns into ``stored``."""
        from smartshoe.kernels.first_order import COLUMNS, inner_products

        products = np.zeros((COLUMNS, COLUMNS))
        (u, slope), y = self.delayed(theta)[index], self._pairs[index][1]
        mask, step = self.masks[index], self.experiments[index].step
        inner_products(
            u,
            slope,
            y,
            EVERY if mask.all() else mask,
            *as_kernels_take(step),
            float(self.experiments[index].time_s[0]),
            shape.alpha,
            shape.p1,
            shape.p2,
            self.constant(theta, index),
            self.state(theta, index),
            stored,
            products,
        )
        return products

    def _evaluate_plainly(self, theta: Array) -> Evaluation:
        residual, jacobian = self.residual_and_jacobian(theta)
        cost, normal = float(residual @ residual), jacobian.T @ jacobian
        # Noise in the gradient is not curvature of the likelihood: left in, it would shorten every step.
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
        root = vectors * np.sqrt(np.maximum(values, 1e-14 * values[-1]))
        half = (vectors / np.sqrt(np.maximum(values, 1e-14 * values[-1]))).T / scale
        shares, axes = np.linalg.eigh(half @ (cost * self._noise_of_gradient(theta)) @ half.T)
        # Far from the optimum the expectation may exceed the actual matrix: always leave some curvature.
        left = (root.T * scale).T @ axes
        signal = (left * (1.0 - np.minimum(shares, MOST_NOISE))) @ left.T
        return Evaluation(cost, jacobian.T @ residual, signal, residual.size)

    def _noise_of_gradient(self, theta: Array) -> Array:
        """(size, size) expected inner products of the whitened error's gradient with itself due to noise alone.

        Relative to the error's variance; computed from the gradient's impulse responses to input and output.
        """
        white = self.whitening(theta)
        if white is None:
            return np.zeros((self.size, self.size))
        shape, step_s = self.shape(theta), self.experiments[0].sample_time_s
        sign = 1.0 if self.settings.direction == "inverse" else -1.0
        impulse = np.zeros(IMPULSE_SAMPLES)
        impulse[2 * HALF_WIDTH] = 1.0
        u, slope = shifted(
            impulse, np.arange(impulse.size, dtype=float) * step_s, step_s, np.mod(sign * self.delay_s(theta), step_s)
        )
        w, w_slope = lag_and_slope(u, shape.alpha, step_s)
        jacobian = np.zeros((self.size, impulse.size))
        own = np.stack([shape.alpha * (shape.p2 - shape.p1) * w_slope, u - w, w])
        jacobian[: self.shape_size] = shape.slope.T @ own
        if self.delay_at is not None:
            slow = lag(slope, shape.alpha, step_s)
            jacobian[self.delay_at] = sign * (shape.p1 * (slope - slow) + shape.p2 * slow)
        from_input = whiten(white, shape.p1 * (u - w) + shape.p2 * w, jacobian)[1]
        from_output = whiten(white, -impulse, np.zeros_like(jacobian))[1]
        products: Array = self.settings.noise_ratio * from_input @ from_input.T + from_output @ from_output.T
        return products

    # -- the stored error --------------------------------------------------------------------------------------
    def residual(self, theta: Array) -> Array:
        """(m,) model minus measured at the counted samples, in output units; whitened where that is enabled."""
        return self.residual_and_jacobian(theta)[0]

    def jacobian(self, theta: Array) -> Array:
        """(m, size) derivative of `residual`."""
        return self.residual_and_jacobian(theta)[1]

    def residual_and_jacobian(self, theta: Array) -> tuple[Array, Array]:
        """(m,) `residual` and (m, size) `jacobian`, from plain filters over whole signals."""
        errors, slopes = [], []
        white = self.whitening(theta)
        for index, mask in enumerate(self.masks):
            error, jacobian = self.error_and_slopes(theta, index)
            if white is not None:
                error, jacobian = whiten(white, np.where(mask, error, 0.0), jacobian * mask)
            errors.append(error[mask])
            slopes.append(jacobian[:, mask])
        return np.concatenate(errors), np.concatenate(slopes, axis=1).T

    def whitening(self, theta: Array) -> Whitening | None:
        """The filter that whitens the error where the input is noisy; None where it is not."""
        if not self.settings.noise_ratio:
            return None
        step = self.experiments[0].sample_time_s
        delay_s = self.delay_s(theta)
        sign = 1.0 if self.settings.direction == "inverse" else -1.0
        gain, gain_slope = interpolation_gain(sign * delay_s, self.experiments[0].time_s, self.experiments[0].step)
        slope = np.zeros((3, self.size))
        slope[:, : self.shape_size] = self.shape(theta).slope
        ratio_slope = np.zeros(self.size)
        if self.delay_at is not None:
            ratio_slope[self.delay_at] = self.settings.noise_ratio * sign * gain_slope
        return whitening(self.shape(theta), slope, step, self.settings.noise_ratio * gain, ratio_slope)

    def model_error(self, theta: Array, index: int) -> Array:
        """(n,) model minus measured of one recording at every sample, including missing ones; never whitened."""
        from smartshoe.kernels.first_order import respond

        experiment, shape, u = self.experiments[index], self.shape(theta), self.delayed(theta)[index][0]
        error, constant, state = np.empty(u.size), self.constant(theta, index), self.state(theta, index)
        step, begin_s = as_kernels_take(experiment.step), float(experiment.time_s[0])
        respond(u, *step, begin_s, shape.alpha, shape.p1, shape.p2, constant, state, error)
        error -= self._pairs[index][1]
        return error

    def model_error_and_slopes(self, theta: Array, index: int) -> tuple[Array, Array]:
        """The same as `error_and_slopes`, from the compiled pass."""
        from smartshoe.kernels.first_order import COLUMNS

        stored, shape = np.empty((COLUMNS, self.experiments[index].time_s.size)), self.shape(theta)
        self._pass(theta, shape, index, stored)
        both = self._to_theta(shape, index).T @ stored
        return both[-1], both[:-1]

    def error_and_slopes(
        self, theta: Array, index: int, signals: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array]:
        """(n,) model minus measured of one recording and its derivatives (size, n) over theta.

        ``signals`` replaces the delayed input and its slope, to compute an instrument's gradient.
        """
        u, u_slope = self.delayed(theta)[index] if signals is None else signals
        experiment, shape = self.experiments[index], self.shape(theta)
        alpha, p1, p2 = shape.alpha, shape.p1, shape.p2
        w, w_slope = lag_and_slope(u, alpha, experiment.step)
        fade = np.exp(-alpha * experiment.time_s)
        state = self.state(theta, index)
        error = p1 * (u - w) + p2 * w + self.constant(theta, index) + state * fade - self._pairs[index][1]
        slopes = np.zeros((self.size, u.size))
        own = np.stack([alpha * ((p2 - p1) * w_slope - state * experiment.time_s * fade), u - w, w])
        slopes[: self.shape_size] = shape.slope.T @ own
        if self.delay_at is not None:
            slow = lag(u_slope, alpha, experiment.step)
            slopes[self.delay_at] = p1 * (u_slope - slow) + p2 * slow
        if self.offset_at is not None:
            slopes[self.offset_at + index] = 1.0
        if self.state_at is not None:
            slopes[self.state_at + index] = fade
        return error, slopes
