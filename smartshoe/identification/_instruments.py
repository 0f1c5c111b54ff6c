"""Instrumental variables: the gradient along a noise-free substitute for the input, so that its noise causes no bias.

The estimate solves Z'e = 0, where Z is the gradient along the substitute and e the prediction error along the measured
signals (Soderstrom and Stoica 1983, *Instrumental Variable Methods for System Identification*). The substitute must
follow the true input and share no noise with it; it need not be exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.errors import NotIdentifiableError, RefusedError
from smartshoe.identification._prediction_error import PredictionError
from smartshoe.identification._solve import solve_normal
from smartshoe.models.first_order import lag, shifted

Source = Literal["command", "cycles"]
LEAST_CORRELATION = 0.9
LONGEST_STEP = 0.5  # of ln alpha
MOST_ITERATIONS = 50  # Newton converges in five or not at all
HALVINGS = 4


class Instruments:
    """Substitutes for the input of each recording: the commanded load, or the mean of the other repeats' readings."""

    def __init__(self, problem: PredictionError, source: Source, readings: Sequence[Array] | None = None) -> None:
        self.problem, self.source = problem, source
        self.readings = readings
        self.usable: list[Mask] = []
        for index, experiment in enumerate(problem.experiments):
            usable = problem.masks[index].copy()
            if source == "command":
                command_n = experiment.command_n
                if command_n is None:
                    raise RefusedError(
                        f"{experiment.name}: no commanded load: log it as command_n, or choose another estimator"
                    )
                both = np.isfinite(command_n) & usable
                if np.count_nonzero(both) > 2 and np.ptp(command_n[both]) > 0:
                    follows = float(np.corrcoef(command_n[both], experiment.load_n[both])[0, 1])
                else:
                    follows = 0.0
                if follows < LEAST_CORRELATION:
                    raise RefusedError(
                        f"{experiment.name}: the commanded load does not follow the measured one (correlation"
                        f" {follows:.2f}): choose another estimator"
                    )
                usable = both
            elif readings is not None:
                usable &= np.isfinite(readings[index])
            self.usable.append(usable)
        if sum(int(np.count_nonzero(usable)) for usable in self.usable) <= 2 * problem.size:
            raise NotIdentifiableError(
                "no load cycle is repeated, so that there is no mean of the others: record three repeats of each rate"
            )

    def _stand_in(self, theta: Array, index: int) -> tuple[Array, Array]:
        """The noise-free input (n,) with the delay applied, and its derivative with respect to the delay."""
        problem, experiment = self.problem, self.problem.experiments[index]
        inverse = problem.settings.direction == "inverse"
        delay_s = problem.delay_s(theta)
        if self.readings is not None:
            reading = np.where(np.isfinite(self.readings[index]), self.readings[index], experiment.reading)
            reading = reading - (problem.settings.offset or 0.0)
            u, slope = shifted(reading, experiment.time_s, experiment.step, delay_s)
            return u, slope
        command_n = np.asarray(experiment.command_n)
        finite = np.isfinite(command_n)
        if not finite.all():
            command_n = np.interp(experiment.time_s, experiment.time_s[finite], command_n[finite])
        u = command_n
        if inverse:
            # The model's reading under the commanded load, with the delay already removed.
            a1, b0, b1 = (float(value) for value in problem.coefficients(theta)[0])
            slow = lag(command_n, b1 / b0, experiment.step)
            u = (command_n - slow) / b0 + (a1 / b1) * slow
        slope = np.gradient(u, experiment.time_s)
        return u, slope if inverse else -slope

    def equations(self, theta: Array) -> tuple[Array, Array, Array, float]:
        """Z'e (size,), Z'J and Z'Z (size, size), and e'e, over the counted samples."""
        size = self.problem.size
        right, normal, power = np.zeros(size), np.zeros((size, size)), np.zeros((size, size))
        cost = 0.0
        for index, usable in enumerate(self.usable):
            error, slopes = self.problem.error_and_slopes(theta, index)
            instrument = self.problem.error_and_slopes(theta, index, self._stand_in(theta, index))[1][:, usable]
            right += instrument @ error[usable]
            normal += instrument @ slopes[:, usable].T
            power += instrument @ instrument.T
            cost += float(error[usable] @ error[usable])
        return right, normal, power, cost

    @property
    def count(self) -> int:
        """The number of counted samples."""
        return sum(int(np.count_nonzero(usable)) for usable in self.usable)


def solve_instrumental(
    instruments: Instruments, theta: Array, sd: Array, *, tolerance: float, max_iterations: int
) -> tuple[Array, Array, float, int, bool]:
    """theta, its covariance, the error's variance, the number of iterations, and whether the equations were solved.

    Newton on Z'e = 0, until a step is below 1e-5 of ``sd`` (size,), the standard deviations of the output-error fit.
    The covariance is variance (Z'J)^-1 Z'Z (J'Z)^-1.
    """
    problem = instruments.problem
    converged, iterations = False, 0
    seen = instruments.equations(theta)
    while not converged and iterations < min(max_iterations, MOST_ITERATIONS):
        iterations += 1
        step = _inverse(seen[1]) @ seen[0]
        longest = float(np.max(np.abs(problem.shape(theta).slope[0] @ step[: problem.shape_size])))
        fraction = min(1.0, LONGEST_STEP / max(longest, 1e-300))
        best = None
        for _ in range(HALVINGS):
            trial = np.clip(theta - fraction * step, problem.lower, problem.upper)
            following = instruments.equations(trial)
            if best is None or _merit(following) < _merit(best[1]):
                best = trial, following
            # The instruments change with theta too, which Newton's step ignores: it may oscillate about the root.
            if _merit(best[1]) < 0.5 * _merit(seen):
                break
            fraction /= 2
        if best is None or not np.isfinite(best[0]).all():
            raise NotIdentifiableError("the instruments do not determine the model: choose another estimator")
        change, theta, seen = best[0] - theta, *best
        converged = bool(
            np.max(np.abs(change) / np.maximum(sd, 1e-300)) < 1e-5
            or np.max(np.abs(change) / (np.abs(theta) + 1e-300)) < tolerance
        )
    _, normal, power, cost = seen
    variance = cost / max(instruments.count - problem.size, 1)
    inverse = _inverse(normal)
    return theta, variance * inverse @ power @ inverse.T, variance, iterations, converged


def _merit(equations: tuple[Array, Array, Array, float]) -> float:
    """e'Z (Z'Z)^-1 Z'e: the part of the squared error that the instruments still explain."""
    right, _, power, _ = equations
    return float(right @ solve_normal(power, right)) if np.isfinite(power).all() else np.inf


def _inverse(matrix: Array) -> Array:
    left = np.sqrt(np.abs(np.diag(matrix)))
    left = np.where(left > 0, left, 1.0)
    try:
        inverse: Array = np.linalg.inv(matrix / np.outer(left, left)) / np.outer(left, left)
    except np.linalg.LinAlgError as error:
        raise NotIdentifiableError(
            f"the instruments do not determine the model ({error}): choose another estimator"
        ) from error
    return inverse
