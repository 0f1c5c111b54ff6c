"""The plain filter in integer arithmetic: its scaling, and a bound on what that does to the force."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Integers
from smartshoe.calibration.export._model import FilterModel
from smartshoe.errors import UsageError

WIDTHS = {"q15": 15, "q31": 31}
HEADROOM = {"q15": 1.25, "q31": 16.0}
"""How far beyond the calibrated load the range goes at least: 16 bits have no step to spare, 32 bits have."""
PRODUCT_BITS = 62  # a product and half a step of what is shifted away stay within 64 bits
LARGEST_SHIFT = 62
WORST_SHARE = 0.01  # of the calibrated load: a bound beyond it is no filter
USUAL_LOAD_N = 800.0


@dataclass(frozen=True)
class Scaled:
    """A constant as ``mantissa`` 2^-``shift``; ``error`` is how far that is from it."""

    mantissa: int
    shift: int
    error: float

    @classmethod
    def of(cls, value: Fraction, largest: int) -> Scaled | None:
        """As many bits as a product with an integer of up to ``largest`` leaves room for; None where none is left."""
        bits: int = PRODUCT_BITS - largest.bit_length()
        size = abs(value)
        magnitude: int = size.numerator.bit_length() - size.denominator.bit_length() + 1 if value else 0
        shift = min(bits - magnitude, LARGEST_SHIFT)
        if shift < 0:
            return None
        mantissa = round(value * 2**shift)
        return cls(mantissa, shift, float(abs(value - Fraction(mantissa, 2**shift))))


@dataclass(frozen=True, kw_only=True)
class IntegerFilter:
    """A filter whose readings and forces are integers of ``width`` bits and a sign.

    They count steps of ``input_lsb`` (reading unit) and ``output_lsb`` (N), both powers of two. ``rounding_n`` bounds
    the force's distance in N from the exact filter of the integers; ``error_bound_n`` adds what rounding the reading
    to its step does.
    """

    width: int
    input_lsb: float
    output_lsb: float
    rounding_n: float
    error_bound_n: float

    @property
    def integer(self) -> str:
        """C's name of the type that goes in and out."""
        return f"int{self.width + 1}_t"

    @property
    def most(self) -> int:
        """The largest integer."""
        return int(2**self.width - 1)

    def steps(self, readings: Array) -> Integers:
        """Readings (n,) as integers, to the nearest step, clipped at the type's ends."""
        return np.clip(np.rint(readings / self.input_lsb), -self.most - 1, self.most).astype(np.int64)


@dataclass(frozen=True, kw_only=True)
class FixedPoint(IntegerFilter):
    """Constants of force = direct r + state - bias, state += feed r - leak state, r the reading in steps.

    State and bias count 2^-``fraction`` of the output's step; the leak is
    taken from the state's bits above ``split`` and below it by turns. The offset of the reading is in the bias,
    exactly, as the filter starts in balance. ``rounding_n`` bounds the force's distance
    in N from the exact filter of the integers; ``error_bound_n`` adds what rounding the reading to its step does.
    """

    width: int
    input_lsb: float
    output_lsb: float
    fraction: int
    split: int
    direct: Scaled
    feed: Scaled
    leak: Scaled
    start: Scaled
    bias: int

    @classmethod
    def of(cls, model: FilterModel, fixed: str) -> FixedPoint:
        """The scaling with the smallest bound; raises `UsageError` where even that is no filter, and of other kinds."""
        if fixed not in WIDTHS:
            raise UsageError(f"fixed point {fixed!r} is not known: use {' or '.join(WIDTHS)}")
        width = WIDTHS[fixed]
        load_n = max(map(abs, model.calibration.load_range_n or (0.0, 0.0))) or USUAL_LOAD_N
        gains = abs(model.static_gain), abs(model.numerator[0])
        # A gain of next to nothing would ask for a range without end.
        slowest = max(min(gains), 0.25 * max(gains))
        reading = abs(model.calibration.offset) + load_n / slowest
        most = 2**width - 1
        input_lsb = power_of_two(HEADROOM[fixed] * reading / most)
        output_lsb = power_of_two(HEADROOM[fixed] * load_n / most)
        try:
            tried = [cls._at(model, width, input_lsb, output_lsb, fraction) for fraction in range(PRODUCT_BITS - width)]
        except OverflowError:  # a coefficient near the end of float64
            tried = []
        found = min((one for one in tried if one is not None), key=lambda one: one.rounding_n, default=None)
        if found is None or not found.error_bound_n <= WORST_SHARE * load_n:
            raise too_coarse(model, fixed, found)
        return found

    @classmethod
    def _at(
        cls, model: FilterModel, width: int, input_lsb: float, output_lsb: float, fraction: int
    ) -> FixedPoint | None:
        n0, n1 = (Fraction(value) for value in model.numerator)
        d1 = Fraction(model.denominator[1])
        leak, feed = 1 + d1, n1 - d1 * n0
        static = (n0 + n1) / leak
        settling = 1 - abs(1 - leak)
        unit = Fraction(input_lsb) / Fraction(output_lsb) * 2**fraction
        largest = 2**width
        state = int(largest * unit * abs(feed) / settling) + 2**fraction + 2
        split = state.bit_length() // 2
        parts = (
            Scaled.of(n0 * unit, largest), Scaled.of(feed * unit, largest), Scaled.of(leak, (state >> split) + 1),
            Scaled.of((static - n0) * unit, largest),
        )  # fmt: skip
        bias = round(static * Fraction(model.calibration.offset) / Fraction(output_lsb) * 2**fraction)
        if any(part is None for part in parts) or abs(bias) + state + largest * abs(n0 * unit) >= 2**PRODUCT_BITS:
            return None
        direct, fed, leaked, start = (part for part in parts if part is not None)
        if leaked.shift < split:
            return None
        # Half a unit at each rounding, and what the constants' own rounding makes of the largest argument.
        step = fed.error * largest + leaked.error * state + 1.5
        units = direct.error * largest + 0.5 + max(start.error * largest + 0.5, step / float(settling)) + 0.5
        rounding_n = output_lsb * (units * 2.0**-fraction + 0.5)
        reading_n = 0.5 * input_lsb * float(abs(n0) + abs(feed) / settling)
        return cls(
            width=width, input_lsb=input_lsb, output_lsb=output_lsb, fraction=fraction, split=split, direct=direct,
            feed=fed, leak=leaked, start=start, bias=bias, rounding_n=rounding_n, error_bound_n=rounding_n + reading_n,
        )  # fmt: skip


@dataclass(frozen=True)
class FixedVector:
    """The test vector of a fixed-point filter: what `FilterModel` tests with, missing readings left out."""

    model: FilterModel
    fixed: IntegerFilter

    @cached_property
    def steps(self) -> Integers:
        """(n,) readings in steps."""
        readings = self.model.test_readings
        return self.fixed.steps(readings[np.isfinite(readings)])

    @cached_property
    def forces_n(self) -> Array:
        """(n,) forces in N that `Compensator.push` gives for `steps`, clipped where the type ends."""
        filter_ = self.model.calibration.compensator(self.model.sample_rate_hz)
        forces_n = filter_.apply(self.steps * self.fixed.input_lsb)
        ends_n = np.array([-self.fixed.most - 1, self.fixed.most]) * self.fixed.output_lsb
        return np.clip(forces_n, *ends_n)


def too_coarse(model: FilterModel, fixed: str, found: IntegerFilter | None) -> UsageError:
    """The refusal of a filter that ``fixed`` cannot hold, with the bound of the best that it can."""
    says = "" if found is None else f", the error would be up to {found.error_bound_n:.3g} N"
    return UsageError(
        f"{fixed} cannot hold the filter of {model.calibration.unit or 'this unit'} at"
        f" {model.sample_rate_hz:g} Hz{says}: use {'--fixed q31' if fixed == 'q15' else '--precision float'}"
    )


def power_of_two(value: float) -> float:
    """The smallest power of two that is not below ``value``."""
    return float(2.0 ** np.ceil(np.log2(value)))
