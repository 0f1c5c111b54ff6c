"""The structure of a residual in a sentence: how large, whether it is more than noise, and where it lies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._denoise import noise_sd
from smartshoe.diagnosis._excitation import stays_still
from smartshoe.diagnosis._gauss_markov import GaussMarkov, gauss_markov_of
from smartshoe.diagnosis._lack_of_fit import LackOfFit, predicted_structure, repeating_structure, slow_structure
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds


@dataclass(frozen=True, eq=False)
class ResidualStructure:
    """The structure of a residual, shares of full scale, by three tests of lack of fit.

    ``repeating``, ``slow`` and ``predicted`` are the tests. ``memory`` describes the slow part: where it is noise it is
    no structure, however slow. ``says`` where the structure is largest. ``size`` is all that exceeds white noise.
    """

    repeating: LackOfFit
    slow: LackOfFit
    predicted: LackOfFit
    memory: GaussMarkov | None
    says: str
    size: float

    @property
    def rms(self) -> float:
        """The largest rms of the significant tests, 0 where none is."""
        return max(self._significant_rms, default=0.0)

    @property
    def significant(self) -> bool:
        """Whether any test is significant."""
        return bool(self._significant_rms)

    @property
    def how(self) -> str:
        """How the largest part behaves, for a sentence.

        It repeats with the load cycles, it follows the load, it changes slowly, or it is correlated only over short
        times.
        """
        if self.predicted.significant and self.predicted.rms >= self.rms:
            return "follows the load"
        if self.repeating.significant and self.repeating.rms >= self.rms:
            return "repeats"
        return "changes slowly" if self.slow.significant else "is correlated over time"

    @property
    def is_noise(self) -> bool:
        """Whether nothing is left but noise, slow or not."""
        return self.memory is not None and self.memory.is_noise and not self.significant

    def sd_of_mean(self, duration_s: float) -> float:
        """Standard deviation of the residual's mean over ``duration_s`` at any place: of noise, or of slow changes.

        Structure that repeats with the load cycles is not counted, since its place in them is known.
        """
        if self.memory is not None and self.memory.is_noise:
            return self.memory.sd_of_mean(duration_s)
        return self.slow.rms if self.how == "changes slowly" else 0.0

    @property
    def is_tested(self) -> bool:
        """Whether a test would have detected all that exceeds white noise; else finding none proves nothing.

        The test of repetition does not count, since structure need not repeat.
        """
        return self.memory is not None or self.slow.would_detect(self.size)

    @property
    def _significant_rms(self) -> list[float]:
        """The rms of each significant test, shares of full scale."""
        if self.memory is not None and self.memory.is_noise:
            return [one.rms for one in (self.repeating, self.predicted) if one.significant]
        found = [one.rms for one in (self.repeating, self.slow, self.predicted) if one.significant]
        # A correlated part that at least one test shows to be no stationary noise is structure, even if it does not
        # repeat.
        remembered = min(self.memory.beyond_noise, self.size) if self.memory is not None else 0.0
        return [*found, remembered] if remembered > 0.0 else found


def residual_structure(
    sessions: Sequence[Session],
    residuals: Sequence[Array],
    thresholds: Thresholds,
    quick: LackOfFit | None = None,
    fine: tuple[Sequence[Session], Sequence[Array]] | None = None,
) -> ResidualStructure:
    """The tests of the ``residuals``, (n,) for each session, and the place of the largest part.

    ``quick`` is the test of repetition at the full rate: thinning averages out what swings faster than the fastest
    ramp. ``fine`` are sessions and residuals at that rate, by which correlation is judged, since the average before
    thinning correlates neighbouring noise; these ones where it is not given.
    """
    memory = gauss_markov_of(*(fine or (sessions, residuals)), thresholds)
    says = worst_place(sessions, residuals, thresholds)
    if memory is not None and memory.switches:
        stay_s = 2.0 * memory.tau_s
        stays = f"for about {stay_s:.2g} s" if math.isfinite(stay_s) else "for longer than these recordings can tell"
        says = f"it switches between two levels and stays at each {stays}; {says}"
    repeats = repeating_structure(sessions, residuals, thresholds)
    if quick is not None and quick.significant and quick.rms > repeats.rms:
        repeats = quick
    return ResidualStructure(
        repeats,
        slow_structure(sessions, residuals, thresholds),
        predicted_structure(sessions, residuals, thresholds),
        memory,
        says,
        beyond_noise(sessions, residuals, thresholds),
    )


def beyond_noise(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> float:
    """Rms of ``residuals``, (n,) for each session, over fitted samples, beyond white noise."""
    square, white, count = 0.0, 0.0, 0
    for session, whole in zip(sessions, residuals, strict=True):
        if session.fitted.any():
            residual = whole[session.fitted]
            square += float(residual @ residual)
            white += noise_sd(residual, thresholds) ** 2 * residual.size
            count += residual.size
    return float(np.sqrt(max(square - white, 0.0) / max(count, 1)))


def worst_place(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> str:
    """A sentence on where the slow part of the residual is largest: load and direction, recording and time."""
    load, rate, stay, error, names = [], [], [], [], []
    for index, (session, residual) in enumerate(zip(sessions, residuals, strict=True)):
        width = min(max(1, round(0.5 / session.conditions.step_s)), residual.size)
        smooth = np.convolve(np.where(session.usable, residual, 0.0), np.full(width, 1.0 / width), "same")
        load.append(session.conditions.load)
        rate.append(session.conditions.rate_per_s)
        stay.append(stays_still(session, thresholds))
        error.append(smooth)
        names += [index] * residual.size
    loads, rates, errors = (np.concatenate(x) for x in (load, rate, error))
    power = errors**2
    total = float(power.sum()) or 1.0
    level = np.clip((loads * 4).astype(int), 0, 3)
    held = (np.abs(rates) < thresholds.still_per_s) & np.concatenate(stay)
    direction = np.where(held, 0, np.where(rates > 0, 1, 2))
    table = np.zeros((3, 4))
    share = np.zeros((3, 4))
    np.add.at(table, (direction, level), power)
    np.add.at(share, (direction, level), 1.0 / power.size)
    d, k = np.unravel_index(int(np.argmax(table)), table.shape)
    doing = ("while the load stands", "while loading", "while unloading")[int(d)]
    numbers = np.array(names)
    worst = max(range(len(sessions)), key=lambda i: float(power[numbers == i].mean()))
    own = power[numbers == worst]
    parts = min(10, own.size)
    at = int(np.argmax([float(part.mean()) for part in np.array_split(own, parts)]))
    part_s = float(sessions[worst].conditions.time_s[-1]) / parts
    begin_s = float(sessions[worst].recording.time_s[0]) + at * part_s
    digits = math.ceil(-math.log10(part_s)) if 0.0 < part_s < 1.0 else 0
    return (
        f"{100 * table[d, k] / total:.0f} % of the power that is left lies at {25 * k}-{25 * (k + 1)} % of full load"
        f" {doing} ({100 * share[d, k]:.0f} % of the samples); the worst stretch is {sessions[worst].recording.name},"
        f" {begin_s:.{digits}f}-{begin_s + part_s:.{digits}f} s"
    )
