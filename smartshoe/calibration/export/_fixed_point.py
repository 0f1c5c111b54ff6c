"""The plain filter in integer arithmetic: its scaling, and a bound on the resulting error of the force."""

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
"""Least range over the calibrated load: 16 bits have no resolution to spare, 32 bits have."""
PRODUCT_BITS = 62  # a product plus half the last bit kept stays within 64 bits
LARGEST_SHIFT = 62
WORST_SHARE = 0.01  # of the calibrated load: with a larger error bound the filter is refused
USUAL_LOAD_N = 800.0


@dataclass(frozen=True)
class Scaled:
    """A constant approximated by ``mantissa`` 2^-``shift``; ``error`` is the absolute error of that."""

    mantissa: int
    shift: int
    error: float

    @classmethod
    def of(cls, value: Fraction, largest: int) -> Scaled | None:
        """``value`` with as many bits as a product with an integer up to ``largest`` allows.

        None if no bits are left.
        """
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
    """A filter whose readings and forces are signed integers of ``width`` bits.

    They count steps of ``input_lsb`` (reading unit) and ``output_lsb`` (N), both powers of two. ``rounding_n`` bounds
    the force's distance in N from the exact filter of the same integers; ``error_bound_n`` adds the effect of rounding
    the reading to its step.
    """

    width: int
    input_lsb: float
    output_lsb: float
    rounding_n: float
    error_bound_n: float

    @property
    def integer(self) -> str:
        """The C type of input and output."""
        return f"int{self.width + 1}_t"

    @property
    def most(self) -> int:
        """The largest integer of that type."""
        return int(2**self.width - 1)

    def steps(self, readings: Array) -> Integers:
        """Readings (n,) as integers, rounded to the nearest step, clipped to the type's range."""
        return np.clip(np.rint(readings / self.input_lsb), -self.most - 1, self.most).astype(np.int64)


@dataclass(frozen=True, kw_only=True)
class FixedPoint(IntegerFilter):
    """Constants of force = direct r + state - bias, state += feed r - leak state, r the reading in steps.

    State and bias count 2^-``fraction`` of the output's step; the leak is computed separately from the state's bits
    above and below ``split``. The reading's offset is part of the bias, exactly, since the filter starts in balance.
    ``rounding_n`` bounds the force's distance in N from the exact filter of the same integers; ``error_bound_n`` adds
    the effect of rounding the reading to its step.
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
        """The scaling with the smallest error bound.

        Raises `UsageError` where even that is too large, and for other kinds.
        """
        if fixed not in WIDTHS:
            raise UsageError(f"fixed point {fixed!r} is not known: use {' or '.join(WIDTHS)}")
        width = WIDTHS[fixed]
        load_n = max(map(abs, model.calibration.load_range_n or (0.0, 0.0))) or USUAL_LOAD_N
        gains = abs(model.static_gain), abs(model.numerator[0])
        # A gain near zero would require an unbounded range.
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
        # Half a unit at each rounding, and the effect of the constants' own rounding on the largest argument.
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
    """The test vector of a fixed-point filter: that of `FilterModel` without missing readings."""

    model: FilterModel
    fixed: IntegerFilter

    @cached_property
    def steps(self) -> Integers:
        """(n,) readings in input steps."""
        readings = self.model.test_readings
        return self.fixed.steps(readings[np.isfinite(readings)])

    @cached_property
    def forces_n(self) -> Array:
        """(n,) forces in N that `Compensator.push` gives for `steps`, clipped to the type's range."""
        filter_ = self.model.calibration.compensator(self.model.sample_rate_hz)
        forces_n = filter_.apply(self.steps * self.fixed.input_lsb)
        ends_n = np.array([-self.fixed.most - 1, self.fixed.most]) * self.fixed.output_lsb
        return np.clip(forces_n, *ends_n)


def too_coarse(model: FilterModel, fixed: str, found: IntegerFilter | None) -> UsageError:
    """The error for a filter that ``fixed`` cannot represent, stating the best bound that it can reach."""
    says = "" if found is None else f", the error would be up to {found.error_bound_n:.3g} N"
    return UsageError(
        f"{fixed} cannot hold the filter of {model.calibration.unit or 'this unit'} at"
        f" {model.sample_rate_hz:g} Hz{says}: use {'--fixed q31' if fixed == 'q15' else '--precision float'}"
    )


def power_of_two(value: float) -> float:
    """The smallest power of two that is at least ``value``."""
    return float(2.0 ** np.ceil(np.log2(value)))
