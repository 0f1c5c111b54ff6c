"""The extended filter in integer arithmetic: its scaling, its error bound, and the C code of its blocks."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, log2

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration._extended import ExtendedCompensator
from smartshoe.calibration.export._blocks import reads_time
from smartshoe.calibration.export._fixed_point import (
    HEADROOM,
    WIDTHS,
    WORST_SHARE,
    IntegerFilter,
    Scaled,
    power_of_two,
    too_coarse,
)
from smartshoe.calibration.export._integer_c import IntegerC
from smartshoe.calibration.export._integer_functions import MOST, functions_text
from smartshoe.calibration.export._model import ExtendedFilterModel
from smartshoe.errors import UsageError
from smartshoe.models.effects.effect import CStep

FRACTION = 46
"""Fractional bits of a share of full scale inside the chain."""
FRACTION_WITH_TIME = 40  # leaves room for six days in seconds
WIDEST = 64  # full scales that a signal may reach between two blocks
RUN = 20_000
"""Samples after the start for which the bound holds: running sums drift by their rounding."""
ROUNDINGS_A_BLOCK = 200
ROUNDINGS_A_SAMPLE = 4  # of a sum over the whole session
MOVED = 24  # positions in the test readings at which a single reading is moved
WALK = 4000  # samples of a walk on which all readings are moved at once
DRAWS = 6  # random choices of which readings move up and which down
DITHER = 0.001  # standard deviation of noise added to these readings, of their span
MARGIN = 2.0
"""Factor on the measured error, for the positions that were not tried."""


Forces = Callable[[Array], Array]


@dataclass(frozen=True)
class IntegerChain:
    """The blocks of an extended filter in integer C: full scale is 2^``fraction`` counts of 64 bits.

    ``clock`` is (start, step, last): the time in counts at the first sample, its step, and the sample at which it
    stops; None where no block reads it. ``functions`` is the C code of the arithmetic that ``blocks`` call, and
    ``widest`` the largest count between two blocks. ``entry`` and ``leaving`` are (factor, exponent), with 2^exponent
    the power of two above full scale: the entry's factor is 2^exponent over the full-scale reading (at least 1), the
    leaving one the full-scale load over 2^exponent (at most 1).
    """

    fraction: int
    blocks: tuple[tuple[str, CStep], ...]
    functions: str
    clock: tuple[int, int, int] | None
    widest: int
    entry: tuple[int, int]
    leaving: tuple[int, int]

    @classmethod
    def of(cls, filter_: ExtendedCompensator, ends: Set[str] = frozenset()) -> IntegerChain:
        """The chain of ``filter_`` in its initial state; raises `UsageError` for C code that has no integer form.

        ``ends``: names of the functions that convert integers at input and output; none where these are floats.
        """
        steps = filter_.c_steps(single=True)
        timed = any(reads_time(step.body) for _, step in steps)
        to = IntegerC(FRACTION_WITH_TIME if timed else FRACTION)
        start, step = (to.count(Fraction(seconds)) for seconds in (filter_.started_s, filter_.step_s))
        share, load_n = filter_.reading_per_share, filter_.model.full_scale_load_n
        above, above_n = ceil(log2(abs(share))), ceil(log2(load_n))
        return cls(
            fraction=to.fraction,
            blocks=tuple((name, _in_integers(to, name, one)) for name, one in steps),
            functions=functions_text(to.used | {"times_q"} | ends, to.fraction),
            clock=(start, step, min((MOST - start) // step, 2**32 - 2)) if timed else None,
            widest=WIDEST * to.one,
            entry=(to.count(Fraction(2) ** above / Fraction(share)), above),
            leaving=(to.count(Fraction(load_n) / Fraction(2) ** above_n), above_n),
        )

    @property
    def roundings(self) -> float:
        """Bound on the rounding error of its integers, as a share of full scale, where no block amplifies it."""
        summed = ROUNDINGS_A_SAMPLE * RUN if any(step.states for _, step in self.blocks) else 0
        return float((ROUNDINGS_A_BLOCK * len(self.blocks) + summed) * 2.0**-self.fraction)


def _in_integers(to: IntegerC, name: str, step: CStep) -> CStep:
    try:
        return to.step(step)
    except ValueError as error:  # raised for the code of an effect from another package
        raise UsageError(
            f"block {name} is written in C that has no integer form ({error}): export in --precision double"
        ) from error


@dataclass(frozen=True, kw_only=True)
class FixedChain(IntegerFilter):
    """The chain of an extended model between integer readings and integer forces.

    A reading times ``entry`` is a count of ``chain``; a count times its leaving factor, divided by 2^``lowered``, is a
    force in steps.

    ``rounding_n`` is half a step of the force plus the roundings inside, amplified as the chain amplifies its input.
    ``error_bound_n`` adds the effect of rounding the readings to their step. It is the larger of two measured figures,
    with a margin: the sum of the effects of moving each single reading by half a step, plus the drift of a hold; or the
    effect of moving all readings of a walk.
    """

    chain: IntegerChain
    entry: Scaled
    lowered: int

    @classmethod
    def of(cls, model: ExtendedFilterModel, fixed: str) -> FixedChain:
        """The chain in ``fixed`` ("q15", "q31").

        Raises `UsageError` where its error would be too large to be useful.
        """
        filter_ = model.filter
        width, full_scale_n = WIDTHS[fixed], filter_.model.full_scale_load_n
        share = abs(filter_.reading_per_share)
        finite = model.test_readings[np.isfinite(model.test_readings)]
        input_lsb = power_of_two(HEADROOM[fixed] * max(float(np.abs(finite).max()), share) / (2**width - 1))
        output_lsb = power_of_two(HEADROOM[fixed] * full_scale_n / (2**width - 1))
        chain = IntegerChain.of(filter_, {"rounded_q"})
        unit = Fraction(input_lsb) / Fraction(filter_.reading_per_share) * 2**chain.fraction
        entry = Scaled.of(unit, 2**width)
        if entry is None:
            raise UsageError(f"a full scale of {share:g} is beyond {fixed}: export without --fixed")
        gain_n = _gain_n(model, 0.5 * input_lsb)
        steepness = max(1.0, gain_n * share / full_scale_n)
        inside_n = full_scale_n * steepness * (chain.roundings + entry.error / float(abs(unit)))
        rounding_n = 0.5 * output_lsb + inside_n
        found = cls(
            width=width,
            input_lsb=input_lsb,
            output_lsb=output_lsb,
            rounding_n=rounding_n,
            error_bound_n=rounding_n + 0.5 * input_lsb * gain_n,
            chain=chain,
            entry=entry,
            lowered=chain.fraction + round(log2(output_lsb)) - chain.leaving[1],
        )
        if not found.error_bound_n <= WORST_SHARE * full_scale_n:
            raise too_coarse(model, fixed, found)
        return found


def _gain_n(model: ExtendedFilterModel, step: float) -> float:
    """Measured largest change of a force per change ``step`` of the readings up to it, in N per reading unit."""
    filter_ = model.calibration.compensator(model.sample_rate_hz)

    def forces_n(readings: Array) -> Array:
        filter_.reset()
        return np.asarray(filter_.push(readings))

    rng = np.random.default_rng(0)
    readings = model.test_readings[np.isfinite(model.test_readings)]
    low, high = float(readings.min()), float(readings.max())
    dither = DITHER * (high - low)
    readings = readings + dither * rng.standard_normal(readings.size)
    corners = rng.choice([low, low, 0.5 * (low + high), high], WALK // 100 + 1)
    walk = np.interp(np.arange(WALK) / 100.0, np.arange(corners.size), corners)
    walk = walk + dither * rng.standard_normal(WALK)
    gains_n = _single_n(forces_n, readings, step) + _held_n(forces_n, high, step, readings.size)
    return MARGIN * max(gains_n, _whole_n(forces_n, walk, step, rng)) / step


def _single_n(forces_n: Forces, readings: Array, step: float) -> float:
    """Largest change in N of a later force when one reading moves by ``step``, summed over the lag."""
    base_n = forces_n(readings)
    lagged_n = np.zeros(readings.size)
    for at in np.linspace(1, readings.size - 1, MOVED).astype(int):
        for sign in (1.0, -1.0):
            moved = readings.copy()
            moved[at] += sign * step
            changed_n = np.abs(forces_n(moved) - base_n)[at:]
            lagged_n[: changed_n.size] = np.maximum(lagged_n[: changed_n.size], changed_n)
    return float(lagged_n.sum())


def _held_n(forces_n: Forces, reading: float, step: float, after: int) -> float:
    """Effect in N of moving the first reading (taken as the steady state), plus the drift beyond ``after`` samples."""
    hold = np.full(RUN, reading)
    begun = np.concatenate([[reading + step], hold[1:]])
    held_n = forces_n(hold)
    drift_n = np.abs(forces_n(hold + step) - held_n)
    first_n = np.abs(forces_n(begun) - held_n)[1:]
    return float(first_n.max()) + max(float(drift_n.max() - drift_n[:after].max()), 0.0)


def _whole_n(forces_n: Forces, walk: Array, step: float, rng: np.random.Generator) -> float:
    """Largest change in N when every reading of a walk moves by ``step``, up or down.

    This finds steep parts of the chain.
    """
    base_n = forces_n(walk)
    signs = [np.ones(walk.size), -np.ones(walk.size), *rng.choice([-1.0, 1.0], (DRAWS, walk.size))]
    return max(float(np.abs(forces_n(walk + step * sign) - base_n).max()) for sign in signs)
