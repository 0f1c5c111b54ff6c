"""`RecursiveIdentification`: the estimate of `identify` from a stream, without storing the samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Integers, require_positive
from smartshoe.calibration import Compensator
from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.identification._conclude import NAMES, WORST_RELATIVE_GAIN_SD, WORST_RELATIVE_SD, solid_of
from smartshoe.identification._experiment import FEWEST_SAMPLES, LEAST_RETURN, Direction
from smartshoe.identification._parametrisation import Shape, coefficients_of
from smartshoe.identification._sufficient_statistics import LN_POLES, POLES, Columns, Projection, Sums, pooled
from smartshoe.identification._uncertainty import inverse_normal, t_quantile
from smartshoe.kernels.blas import on_one_thread
from smartshoe.models import Parameter
from smartshoe.units import Unit, declared, find_unit

BLOCK = 1024  # samples per triangular update


@dataclass
class _Experiment:
    """An experiment in progress: the absorbed samples, and up to a block of pending ones."""

    name: str
    sums: Sums
    u: Array = field(default_factory=lambda: np.empty(BLOCK))
    y: Array = field(default_factory=lambda: np.empty(BLOCK))
    at: Integers = field(default_factory=lambda: np.empty(BLOCK, dtype=np.int64))
    filled: int = 0
    seen: int = 0


@dataclass(frozen=True, eq=False)
class RecursiveEstimate:
    """The estimate from the stream so far; names are those of `Identification`.

    ``parameters`` a1, b0, b1, k1, k2, c of Chinimilli 2016 (13) and (2), ``covariance`` (6, 6) in their order,
    linearised at the optimum; ``offsets`` by experiment the reading at no load, ``initial_states`` the coefficient of
    the decaying initial transient; ``rmse`` in ``rmse_unit``; ``n_samples`` counted and ``n_missing`` samples;
    ``iterations`` is the number of evaluations of the cost.
    """

    unit: str
    direction: Direction
    parameters: Mapping[str, Parameter]
    covariance: Array
    offsets: Mapping[str, Parameter]
    initial_states: Mapping[str, Parameter]
    fit_percent: float
    rmse: float
    rmse_unit: str
    n_samples: int
    n_missing: int
    iterations: int
    reading_unit: Unit
    delay_s: float

    def compensator(self, sample_rate_hz: float = 100.0) -> Compensator:
        """The filter that turns readings into force in N, with the mean of the experiments' offsets."""
        a1, b0, b1 = (self.parameters[name].value for name in ("a1", "b0", "b1"))
        offset = float(np.mean([zero.value for zero in self.offsets.values()]))
        return Compensator(a1, b0, b1, offset=offset, sample_rate_hz=sample_rate_hz, reading_unit=self.reading_unit)


class RecursiveIdentification:
    """The output-error estimate of `identify` with a fixed delay, from samples at an even rate as they arrive.

    ``direction``, ``offset``, ``initial_state`` and ``scale`` (N per reading unit of the paper's force) are as in
    `identify`; ``unit`` names the sensing unit. ``delay_s`` is 0: the interpolation that compensates a delay needs
    future samples, and its best value would have to be known before the first sample is absorbed. Take the delay from
    `identify` on a whole recording and shift the stream by it before pushing. All samples keep their weight. Relaxation
    rates between 0.003 and 300 1/s can be found.
    """

    def __init__(
        self,
        *,
        sample_rate_hz: float,
        direction: Direction = "inverse",
        reading_unit: str = "mbar",
        unit: str = "unit",
        offset: float | Literal["estimate"] = "estimate",
        delay_s: float = 0.0,
        initial_state: Literal["estimate", "steady"] = "estimate",
        scale: float = 1.0,
    ) -> None:
        require_positive(sample_rate_hz, "sample_rate_hz")
        require_positive(scale, "scale")
        if direction not in get_args(Direction):
            raise UsageError(f"direction {direction!r} is not known: use one of {', '.join(get_args(Direction))}")
        if initial_state not in ("estimate", "steady"):
            raise UsageError(f"initial_state {initial_state!r} is not known: use one of estimate, steady")
        if offset != "estimate" and (isinstance(offset, str) or not np.isfinite(offset)):
            raise UsageError(f"offset is {offset!r}: give a finite number or 'estimate'")
        if delay_s != 0.0:
            raise UsageError(f"delay_s is {delay_s:g}: shift the stream by it, and leave delay_s at 0")
        self.unit, self.direction, self.scale = unit, direction, float(scale)
        self.reading_unit = find_unit(reading_unit) or declared(reading_unit)
        self.sample_rate_hz = float(sample_rate_hz)
        self._offset = None if isinstance(offset, str) else float(offset)
        self._columns = Columns.of(initial_state == "estimate", self._offset is None)
        self._inverse = direction == "inverse"
        self._closed: list[tuple[str, Sums]] = []
        self._missing = 0
        self._open = self._begun("experiment 1")

    def _begun(self, name: str) -> _Experiment:
        return _Experiment(name, Sums(np.zeros((0, self._columns.columns)), np.zeros(POLES)))

    @property
    def state_bytes(self) -> int:
        """Memory of the stored state in bytes: it grows with the number of experiments, not of samples."""
        own = self._open
        arrays = [own.u, own.y, own.at, own.sums.root, own.sums.lags]
        arrays += [array for _, sums in self._closed for array in (sums.root, sums.lags)]
        return sum(array.nbytes for array in arrays)

    @on_one_thread
    def start_experiment(self, name: str) -> None:
        """Begin another recording, with its own offset and initial state."""
        if any(name == known for known, _ in self._closed) or (self._open.seen and name == self._open.name):
            raise UsageError(f"there is an experiment {name!r} already: give another name")
        if self._open.seen:
            self._closed.append((self._open.name, self._sums_now()))
        self._open = self._begun(name)

    @on_one_thread
    def push(self, force_n: ArrayLike, reading: ArrayLike) -> None:
        """Add loads in N and readings, numbers or blocks (n,); values that are not finite are missing.

        A missing input is interpolated linearly between its neighbours; a sample counts where both values are present.
        How the stream is divided into blocks makes no difference, to the last digit.
        """
        load = np.atleast_1d(np.asarray(force_n, dtype=float))
        pressure = np.atleast_1d(np.asarray(reading, dtype=float))
        if load.ndim != 1 or load.shape != pressure.shape:
            raise UsageError(
                f"push was given loads of shape {load.shape} and readings of shape {pressure.shape}: give as many of"
                " each, as floats or as (n,)"
            )
        own = self._open
        there = np.isfinite(load) & np.isfinite(pressure)
        self._missing += int(there.size - np.count_nonzero(there))
        pressure = pressure - (self._offset or 0.0)
        u, y = (pressure, load) if self._inverse else (load, pressure)
        at = own.seen + np.arange(u.size)
        own.seen += u.size
        # A missing input lies on one straight line: nothing is stored until the next input arrives.
        present = np.isfinite(u)
        if not present.all():
            u, y, at = u[present], y[present], at[present]
        y = np.where(np.isfinite(y), y, np.nan)
        done = 0
        while done < u.size:
            take = min(BLOCK - own.filled, u.size - done)
            free, given = slice(own.filled, own.filled + take), slice(done, done + take)
            own.u[free], own.y[free], own.at[free] = u[given], y[given], at[given]
            own.filled, done = own.filled + take, done + take
            if own.filled == BLOCK:
                self._absorb(own.sums, own)
                own.filled = 0

    def _absorb(self, sums: Sums, own: _Experiment) -> None:
        n = own.filled
        sums.absorb(own.u[:n], own.y[:n], own.at[:n], 1.0 / self.sample_rate_hz, self._columns, self._inverse)

    def _sums_now(self) -> Sums:
        """The open experiment's sums over all of its samples; the stored ones are not changed."""
        sums = replace(self._open.sums, lags=self._open.sums.lags.copy())
        self._absorb(sums, self._open)
        return sums

    @on_one_thread
    def estimate(self) -> RecursiveEstimate:
        """The minimiser over all samples so far.

        Raises `NotIdentifiableError`, naming the reason, while the data cannot determine the parameters, and
        `NotConvergedError` where no minimum of the cost is found.
        """
        experiments = [
            (name, sums) for name, sums in [*self._closed, (self._open.name, self._sums_now())] if sums.count
        ]
        self._require_identifiable([sums for _, sums in experiments])
        roots = [sums.root for _, sums in experiments]
        projection = Projection(roots, self._columns)
        solved = projection.minimise(self.unit)
        theta, count = solved.theta, sum(sums.count for _, sums in experiments)
        degrees = count - theta.size
        if degrees < 1:
            raise NotIdentifiableError(f"{self.unit}: {count} samples for {theta.size} unknowns: push more")
        inverse, degenerate = inverse_normal(solved.jacobian.T @ solved.jacobian)
        full = solved.cost / degrees * inverse
        shape = Shape(float(np.exp(theta[0])), float(theta[1]), float(theta[2]), np.eye(3))
        coefficients, to_coefficients = coefficients_of(shape, self.direction)
        spread = (0, 0.0, 0.0)
        for _, sums in experiments:
            spread = pooled(spread, (sums.count, sums.mean, sums.squares))
        solid, to_solid, _ = solid_of(coefficients, self.scale)
        slope = np.zeros((6, theta.size))
        slope[:3, :3], slope[3:, :3] = to_coefficients, to_solid @ to_coefficients
        values, covariance = np.concatenate([coefficients, solid]), slope @ full @ slope.T
        sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        loose = full[2, 2] > (WORST_RELATIVE_GAIN_SD * theta[2]) ** 2
        if solved.cost > 0.5 * spread[2] and (degenerate or loose):
            raise NotIdentifiableError(
                f"{self.unit}: the reading does not follow the load so far, so that no gain can be found: record a load"
                " that rises and falls well above the noise"
            )
        edge = min(theta[0] - LN_POLES[-1], LN_POLES[0] - theta[0]) < 1e-6
        if edge or degenerate or not values[0] > 0 or not sd[0] <= WORST_RELATIVE_SD * values[0]:
            raise NotIdentifiableError(
                f"{self.unit}: the relaxation (a1 = {values[0]:.3g} 1/s) cannot be determined so far: record more"
                " triangles, at several rates, with rests between"
            )
        quantile, symbol = t_quantile(degrees), self.reading_unit.symbol
        units = ("1/s", f"N/{symbol}", f"N/({symbol} s)", "1", "1", "s")
        names = [name for name, _ in experiments]
        output_unit = "N" if self._inverse else symbol
        return RecursiveEstimate(
            unit=self.unit,
            direction=self.direction,
            parameters={
                name: Parameter.from_sd(value, d, text, quantile)
                for name, value, d, text in zip(NAMES, values, sd, units, strict=True)
            },
            covariance=covariance,
            offsets=self._offsets(names, theta, full, quantile),
            initial_states={
                name: _linear(theta, full, projection.state_at, index, output_unit, quantile)
                for index, name in enumerate(names)
            },
            fit_percent=100.0 * (1.0 - float(np.sqrt(solved.cost / spread[2]))),
            rmse=float(np.sqrt(solved.cost / count)),
            rmse_unit=output_unit,
            n_samples=count,
            n_missing=self._missing,
            iterations=solved.iterations,
            reading_unit=self.reading_unit,
            delay_s=0.0,
        )

    def compensator(self, sample_rate_hz: float | None = None) -> Compensator:
        """The filter of the current estimate, by default at the stream's rate; raises as `estimate`."""
        return self.estimate().compensator(sample_rate_hz or self.sample_rate_hz)

    def _offsets(self, names: list[str], theta: Array, full: Array, quantile: float) -> dict[str, Parameter]:
        """By experiment, the reading at no load: the free constant, converted by the static gain if it is a load."""
        symbol = self.reading_unit.symbol
        if self._offset is not None:
            return {name: Parameter.from_sd(self._offset, 0.0, symbol) for name in names}
        found = {}
        for index, name in enumerate(names):
            constant, gradient = float(theta[3 + index]), np.zeros(theta.size)
            if self._inverse:
                gradient[3 + index], gradient[2] = -1.0 / theta[2], constant / theta[2] ** 2
                constant = -constant / float(theta[2])
            else:
                gradient[3 + index] = 1.0
            sd = float(np.sqrt(max(float(gradient @ full @ gradient), 0.0)))
            found[name] = Parameter.from_sd(constant, sd, symbol, quantile)
        return found

    def _require_identifiable(self, sums: list[Sums]) -> None:
        count = sum(one.count for one in sums)
        if count < FEWEST_SAMPLES:
            raise NotIdentifiableError(
                f"{self.unit}: {count} samples with both load and reading so far: push {FEWEST_SAMPLES} at least"
            )
        lowest, highest = min(one.lowest_load for one in sums), max(one.highest_load for one in sums)
        for what, ends in (
            ("load", [(one.lowest_load, one.highest_load) for one in sums]),
            ("reading", [one.reading_ends for one in sums]),
        ):
            largest = max(max(abs(low), abs(high)) for low, high in ends)
            if max(high - low for low, high in ends) <= 1e-12 * largest:
                raise NotIdentifiableError(
                    f"{self.unit}: the {what} is constant, a single static level, so far: load and unload the unit"
                )
        rise, fall = max(one.rise for one in sums), max(one.fall for one in sums)
        if min(rise, fall) < LEAST_RETURN * (highest - lowest):
            missing = "has not fallen again" if fall < rise else "has not risen"
            raise NotIdentifiableError(
                f"{self.unit}: the load {missing} (no return) so far, so that the loop is not seen: load and unload"
            )


def _linear(theta: Array, full: Array, first: int | None, index: int, unit: str, quantile: float) -> Parameter:
    if first is None:
        return Parameter.from_sd(0.0, 0.0, unit, quantile)
    at = first + index
    return Parameter.from_sd(float(theta[at]), float(np.sqrt(max(full[at, at], 0.0))), unit, quantile)
