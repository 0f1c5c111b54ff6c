"""Output-error fits of an extended model to several sessions at once, with whitened noise and bounds."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.noise import NoiseModel
from smartshoe.diagnosis.screen import TARE, Rests
from smartshoe.diagnosis.session import Session
from smartshoe.masks import bridged
from smartshoe.models.effects import EffectParameter
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_STEPS = 12
QUICK_STEPS = 8  # of a fit that is only compared with others
SETTLED = 0.05  # fall of -2 log likelihood that ends a fit
LOG_RANGE = 30.0  # ratio of bounds from which a parameter of shape is stepped in its logarithm
LARGEST_LOG_STEP = 1.0
DISPLACEMENT_COUNTS = 60.0


@dataclass(frozen=True, eq=False)
class Fit:
    """``cost`` is -2 log likelihood but for a constant, over the fitted samples; ``covariance`` (p, p) of theta."""

    model: ExtendedModel
    cost: float
    covariance: Array

    def sd(self, k: int) -> float:
        """Standard deviation of parameter k."""
        return float(np.sqrt(max(self.covariance[k, k], 0.0)))


@dataclass(frozen=True, eq=False)
class Evidence:
    """What fits are judged by: sessions, the noise, and the loads seen in rests.

    A unit that carries nothing must be told no load: in rests the measured load plus a tare is zero within
    ``rest_sd``. That row tells a load cell's tare from a sensor's zero, which the waveform cannot.
    ``kept``: effects that were found before any fit (a delay between two clocks) and are not dropped again.
    """

    sessions: Sequence[Session]
    noise: NoiseModel
    rest_load: Array
    rest_sd: float
    kept: frozenset[str] = frozenset()

    @cached_property
    def fitted(self) -> tuple[Session, ...]:
        """The sessions that a fit looks at."""
        return tuple(session for session in self.sessions if session.fitted.any())

    @cached_property
    def judged(self) -> tuple[Session, ...]:
        """The sessions of which something was held out."""
        return tuple(session for session in self.sessions if session.judged.any())

    def residuals(self, model: ExtendedModel) -> list[Array]:
        """Reading less simulation, a session each, in shares of full scale; bridged over samples that are faulty."""
        return [
            bridged(one.conditions.time_s, one.reading - model.simulate(one.conditions), one.usable)
            for one in self.sessions
        ]

    def cost(self, model: ExtendedModel) -> float:
        """Sum of whitened squares over what is fitted."""
        rest = self._rest(model)
        return sum(self._white_square(model, one, one.fitted) for one in self.fitted) + float(rest @ rest)

    def held_out_cost(self, model: ExtendedModel) -> float:
        """Sum of whitened squares over what was held out."""
        return sum(self._white_square(model, one, one.judged) for one in self.judged)

    def held_out_square(self, model: ExtendedModel) -> float:
        """Mean squared error over what was held out, as it is."""
        total, count = 0.0, 0
        for session in self.judged:
            left = (session.reading - model.simulate(session.conditions))[session.judged]
            total += float(left @ left)
            count += left.size
        return total / max(count, 1)

    def _white_square(self, model: ExtendedModel, session: Session, kept: Mask) -> float:
        residual = session.reading - model.simulate(session.conditions)
        white = self.noise.whitened(residual)[self.noise.counted(kept)]
        return float(white @ white)

    def cost_of_corners(self, model: ExtendedModel) -> float:
        """The cost of ``model`` under the measured load, less what that load's noise is expected to add to it.

        A cleaned load has lost the rounding of its corners, by which a lag is told from a delay; a noisy one is fitted
        best by a model that smooths it. So the noise stays in, and a draw of the same noise tells what it adds (after
        Cook and Stefanski 1994). Up to half the Nyquist frequency: above it the two interpolate differently.
        """
        total = 0.0
        for session in self.fitted:
            if session.measured_load is None or session.load_noise is None:
                return self.cost(model)
            given, load = session.conditions, session.measured_load
            reading = model.simulate(replace(given, load=load))
            noisier = model.simulate(replace(given, load=given.load + session.load_noise))
            total += self._slow_square(session.reading - reading, session)
            total -= self._slow_square(noisier - model.simulate(given), session)
        return total

    def _slow_square(self, residual: Array, session: Session) -> float:
        """Sum of whitened squares over what is fitted, of the lower half of all frequencies."""
        white = np.where(self.noise.counted(session.fitted), self.noise.whitened(residual), 0.0)
        power = np.abs(np.fft.rfft(white)) ** 2
        return float(2.0 * power[1 : power.size // 2].sum() / white.size)

    def displacement_cost(self, model: ExtendedModel) -> float:
        """What the crosshead's displacement says against a model, on the scale of -2 log likelihood.

        The displacement is a straight line of the wall's deformation and of the load (the frame's own compliance).
        It tells a curve of the wall from one of the sensor. Its noise is far below the model's errors, so that only
        the ratio of errors counts, as if it had `DISPLACEMENT_COUNTS` independent samples.
        """
        total, error = 0.0, 0.0
        for session in self.fitted:
            if session.displacement is None:
                return 0.0
            kept = session.fitted
            if kept.sum() < 10:
                continue
            conditions = session.conditions
            columns = np.column_stack([np.ones(conditions.load.size), model.deformation(conditions), conditions.load])
            target = session.displacement[kept]
            found, *_ = np.linalg.lstsq(columns[kept], target, rcond=None)
            left = target - columns[kept] @ found
            error += float(left @ left)
            total += float(np.sum((target - target.mean()) ** 2))
        return DISPLACEMENT_COUNTS * float(np.log(max(error, 1e-12 * total) / total)) if total > 0 else 0.0

    def _rest(self, model: ExtendedModel) -> Array:
        return (self.rest_load + tare_of(model)) / self.rest_sd

    def rests(self, model: ExtendedModel, without: Mapping[str, ExtendedModel] | None = None) -> Rests:
        """What the rests say of ``model``, and of the models ``without`` a part each."""
        residual = self._rest(model)
        shares = {name: self._rest(less) - residual for name, less in (without or {}).items()}
        return Rests(residual, 1.0 / self.rest_sd, shares)

    def rows(self, model: ExtendedModel) -> tuple[Array, Array]:
        """Whitened residual (m,) and sensitivities (m, p) over what is fitted."""
        found, slopes = [], []
        for session in self.fitted:
            reading, sensitivities = model.sensitivities(session.conditions)
            counted = self.noise.counted(session.fitted)
            both = np.column_stack([session.reading - reading, sensitivities])
            white = self.noise.whitened(both)[counted]
            found.append(white[:, 0])
            slopes.append(white[:, 1:])
        rest = self._rest(model)
        column = np.zeros((rest.size, slopes[0].shape[1]))
        for k, (owner, _) in enumerate(model.parameters):
            if owner == TARE:
                column[:, k] = -1.0 / self.rest_sd
        return np.concatenate([*found, rest]), np.concatenate([*slopes, column])


def tare_of(model: ExtendedModel) -> float:
    """Load in shares of full scale that the model adds to the measured one."""
    return next((float(part.values[0]) for part in model.parts if part.name == TARE), 0.0)


def fit(
    evidence: Evidence,
    start: ExtendedModel,
    steps: int = MOST_STEPS,
    settled: float = SETTLED,
    still: Collection[str] = (),
) -> Fit:
    """Levenberg-Marquardt within the parameters' bounds, from ``start``; parameters of shape in their logarithm.

    The parameters of the effects in ``still`` stay where they are.
    """
    parameters = [parameter for _, parameter in start.parameters]
    logarithmic = np.array([_is_logarithmic(p) for p in parameters])
    low, high = np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])
    fixed = np.array([owner in still for owner, _ in start.parameters])
    low, high = np.where(fixed, start.theta, low), np.where(fixed, start.theta, high)
    model = start.at(np.clip(start.theta, low, high))
    residual, slopes = evidence.rows(model)
    cost = float(residual @ residual)
    damping = 1e-4
    for _ in range(steps):
        theta = model.theta
        J = slopes * np.where(logarithmic, theta, 1.0)
        normal, right = J.T @ J, J.T @ residual
        best: tuple[float, ExtendedModel] | None = None
        for _ in range(6):
            step = _bounded_step(normal, right, damping, theta, low, high, logarithmic)
            moved = np.clip(
                np.where(logarithmic, theta * np.exp(np.where(logarithmic, step, 0.0)), theta + step), low, high
            )
            trial = model.at(moved)
            trial_cost = evidence.cost(trial)
            if np.isfinite(trial_cost) and trial_cost < cost:
                best = trial_cost, trial
                damping = max(damping * 0.1, 1e-7)
                break
            damping = max(damping * 10.0, 1e-4)
        if best is None:
            break
        fell = cost - best[0]
        cost, model = best
        residual, slopes = evidence.rows(model)
        if fell < settled:
            break
    return Fit(model, cost, _covariance(slopes))


def _is_logarithmic(parameter: EffectParameter) -> bool:
    return parameter.null is None and parameter.lower > 0 and parameter.upper / parameter.lower >= LOG_RANGE


def _bounded_step(
    normal: Array, right: Array, damping: float, theta: Array, low: Array, high: Array, logarithmic: NDArray[np.bool_]
) -> Array:
    """The damped step over the parameters that are not pushed against a bound or without any influence."""
    diagonal = np.diag(normal)
    free = diagonal > 1e-12 * max(float(diagonal.max()), 1e-300)
    step = np.zeros(theta.size)
    for _ in range(theta.size):
        index = np.flatnonzero(free)
        if not index.size:
            break
        part = normal[np.ix_(index, index)] + damping * np.diag(diagonal[index])
        root = np.sqrt(np.diag(part))
        step[:] = 0.0
        step[index] = np.linalg.lstsq(part / np.outer(root, root), right[index] / root, rcond=1e-12)[0] / root
        step = np.where(logarithmic, np.clip(step, -LARGEST_LOG_STEP, LARGEST_LOG_STEP), step)
        outward = ((theta <= low) & (step < 0)) | ((theta >= high) & (step > 0))
        if not (outward & free).any():
            break
        free &= ~outward
    return step


def _covariance(slopes: Array) -> Array:
    scale = np.sqrt(np.sum(slopes**2, axis=0))
    seen = scale > 0
    out = np.full((scale.size, scale.size), 0.0)
    index = np.flatnonzero(seen)
    if index.size:
        part = slopes[:, index] / scale[index]
        inverse = np.linalg.pinv(part.T @ part, rcond=1e-12, hermitian=True)
        out[np.ix_(index, index)] = inverse / np.outer(scale[index], scale[index])
    return out
