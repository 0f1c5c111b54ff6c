"""What every target exports: the discrete filter in its forms, a test vector, and its provenance."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration._calibration import Calibration
from smartshoe.calibration._extended import ExtendedCompensator
from smartshoe.calibration.export._names import DEFAULT_NAME
from smartshoe.errors import UsageError
from smartshoe.models import discretise

DOUBLE_ROUNDING = 2.0**-53
FLOAT_ROUNDING = 2.0**-24


@dataclass(frozen=True)
class FilterModel:
    """A first-order filter ready for export; ``kind`` names its templates, ``name`` its files and symbols.

    ``numerator`` and ``denominator``, (2,) each in falling powers of z, are the very numbers that `Compensator` runs;
    ``provenance`` goes into a header comment, key to text.
    """

    calibration: Calibration
    sample_rate_hz: float
    numerator: tuple[float, float]
    denominator: tuple[float, float]
    name: str = DEFAULT_NAME
    kind: str = "first_order"

    @classmethod
    def of(cls, calibration: Calibration, sample_rate_hz: float | None = None, name: str = DEFAULT_NAME) -> FilterModel:
        """The model of ``calibration`` at ``sample_rate_hz``; raises `UsageError` where the rate cannot be used."""
        rate_hz = calibration.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
        with np.errstate(over="ignore", invalid="ignore"):
            numerator, denominator = discretise(calibration.a1, calibration.b0, calibration.b1, rate_hz, "bilinear")
        # 1 - |den1| is the pole's distance from 1: below this, rounding of den1 alone changes the static gain by 1e-4.
        if not (np.isfinite(numerator).all() and 1.0 - abs(denominator[1]) > 1e-12):
            raise UsageError(
                f"sample_rate_hz is {rate_hz:g}, too far from the pole of {calibration.a1:g} 1/s for double precision:"
                " give the rate at which the firmware samples"
            )
        n0, n1 = (float(value) for value in numerator)
        model = cls if calibration.extended is None else ExtendedFilterModel
        return model(calibration, float(rate_hz), (n0, n1), (1.0, float(denominator[1])), name)

    @property
    def static_gain(self) -> float:
        """Force over reading in steady state, in N per reading unit, of the discrete filter."""
        return float(np.sum(self.numerator) / np.sum(self.denominator))

    @property
    def leak(self) -> float:
        """1 + den1, the share of its state that the filter loses per sample."""
        return float(1 + Fraction(self.denominator[1]))

    @property
    def feed(self) -> float:
        """n1 - den1 n0, in N per reading unit, so that state += feed*u - leak*state and force = n0*u + state."""
        n0, n1 = (Fraction(value) for value in self.numerator)
        return float(n1 - Fraction(self.denominator[1]) * n0)

    @property
    def state_gain(self) -> float:
        """Static gain minus the direct term: the steady state per unit of reading."""
        return self.static_gain - self.numerator[0]

    @cached_property
    def test_readings(self) -> Array:
        """(n,) readings in the reading unit: missing, rest, ramps, a hold, a step, both kinds of missing again.

        Rounded to single precision, so that a float build gets the same numbers.
        """
        load_n = (self.calibration.load_range_n or (0.0, 800.0))[1] or 800.0
        span = load_n / self.static_gain if abs(self.static_gain) > 1e-6 * abs(self.numerator[0]) else load_n
        at = np.arange(500)
        shape = np.interp(at, [0, 20, 120, 220, 260, 300, 301, 499], [0, 0, 1, 0, 0.7, 0.7, 0.2, 0.9])
        with np.errstate(over="ignore"):
            readings = (self.calibration.offset + span * shape).astype(np.float32).astype(float)
        readings[[0, 1, 150, 151]] = np.nan
        readings[[400, 401]] = np.inf, -np.inf
        return readings

    @cached_property
    def test_forces_n(self) -> Array:
        """(n,) forces in N that `Compensator.push` gives for `test_readings`."""
        filter_ = self.calibration.compensator(self.sample_rate_hz)
        return np.array([filter_.push(float(value)) for value in self.test_readings])

    def tolerance_n(self, precision: str) -> float:
        """Bound in N on the effect of rounding on `test_forces_n` in ``precision``.

        Rounding errors of each step and of its terms accumulate in the state for min(n, 1/(1 - |den1|)) samples. In
        double the terms are den1*force and n1*u. In float they are feed*u and leak*state, smaller by the leak; the sum
        itself loses nothing, as its rounding error is carried over.
        """
        finite = self.test_readings[np.isfinite(self.test_readings)]
        u = float(np.abs(finite - self.calibration.offset).max(initial=0.0))
        memory = min(len(self.test_readings), 1.0 / (1.0 - abs(self.denominator[1])))
        if precision == "double":
            terms_n = (abs(self.numerator[0]) + abs(self.numerator[1])) * u + abs(self.test_forces_n).max()
            return float(max(1e-12 * terms_n, 4 * DOUBLE_ROUNDING * terms_n * (memory + 1.0)))
        state_n = max(abs(self.state_gain), abs(self.feed)) * u
        reading_n = (abs(self.numerator[0]) + abs(self.state_gain)) * (u + abs(self.calibration.offset))
        return float(
            4 * FLOAT_ROUNDING * (state_n * (self.leak * memory + 1.0) + reading_n + abs(self.test_forces_n).max())
        )

    @property
    def provenance(self) -> dict[str, str]:
        """The origin of the filter, for the reader of the file: key to one line of text."""
        calibration = self.calibration
        found = origin(calibration, self.sample_rate_hz)
        found["reading"] = one_safe_line(
            f"{calibration.reading_unit.symbol}, offset {calibration.offset!r} (taken off by the filter)"
        )
        found["model"] = (
            f"force = (b0 s + b1)/(s + a1) (reading - offset), a1 = {calibration.a1!r} 1/s,"
            f" b0 = {calibration.b0!r}, b1 = {calibration.b1!r} 1/s, bilinear transform"
        )
        return found


@dataclass(frozen=True)
class ExtendedFilterModel(FilterModel):
    """The inverse of an extended model's chain; numerator and denominator are those of its linear part."""

    kind: str = "extended"

    @cached_property
    def filter(self) -> ExtendedCompensator:
        """The exported filter, in its initial state."""
        found = self.calibration.compensator(self.sample_rate_hz)
        if not isinstance(found, ExtendedCompensator):
            raise UsageError(f"calibration of {self.calibration.unit or 'a unit'} holds no extended model")
        return found

    @property
    def is_steep(self) -> bool:
        """Whether single precision between two blocks would change the force too much."""
        undone = {name for name, _ in self.filter.blocks}
        return any(part.effect.is_steep_undone for part in self.filter.model.parts if part.name in undone)

    def tolerance_n(self, precision: str) -> float:
        """Bound in N on the effect of rounding on `test_forces_n`.

        Each block runs in the filter's order of operations. In double, differences come only from the library's exp and
        pow, some 1e-14 of full scale; the bound is a billionth, and a wrong constant shows in the fourth digit. In
        float it is two dozen roundings per block, of the largest force; six in all where the chain is steep, and
        therefore run in integers.
        """
        most_n = max(np.abs(self.test_forces_n).max(), self.filter.model.full_scale_load_n)
        if precision == "float" and self.is_steep:
            return float(most_n * 6 * FLOAT_ROUNDING)
        return float(most_n * (1e-9 if precision == "double" else 24 * FLOAT_ROUNDING * len(self.filter.blocks)))

    @property
    def provenance(self) -> dict[str, str]:
        """As for the plain filter, with the effects added."""
        filter_ = self.filter
        found = super().provenance
        found["reading"] = one_safe_line(self.calibration.reading_unit.symbol)
        found["model"] = one_safe_line(
            "the standard linear solid with effects, undone last block first; relaxation"
            f" {filter_.model.relaxing_share:.6g} of the load at {filter_.model.relaxation_rate_per_s:.6g} 1/s"
        )
        for part in filter_.model.parts:
            values = ", ".join(f"{one.name} = {value!r} {one.unit}" for one, value in part.valued)
            found[f"effect {part.name}"] = one_safe_line(values or "no parameter")
        for name, says in filter_.not_inverted.items():
            found[f"not compensated, {name}"] = one_safe_line(says)
        for name, says in filter_.cautions.items():
            found[f"caution, {name}"] = one_safe_line(says)
        return found


def one_safe_line(text: str) -> str:
    """``text`` as one line that can neither end nor nest a C comment, nor continue a line."""
    line = " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
    # Slash and star next to each other, and ??/ (a trigraph for the backslash), have a meaning in a C comment.
    return line.replace("/*", "/ *").replace("*/", "* /").replace("\\", "/").replace("??", "? ?").replace("/*", "/ *")


def origin(calibration: Calibration, sample_rate_hz: float) -> dict[str, str]:
    """Where a calibration comes from and its range of validity, key to one line of text; the caller sets "model"."""
    from smartshoe.version import __version__

    low_high = calibration.load_range_n
    rates = calibration.rate_range_n_per_s
    said = {
        "unit": calibration.unit or "(unnamed)",
        "reading": calibration.reading_unit.symbol,
        "force": "N, compression positive",
        "sample rate": f"{sample_rate_hz!r} Hz: call once a sample at this rate and no other",
        "model": "",
        "calibrated load": "not known" if low_high is None else f"{low_high[0]:g} to {low_high[1]:g} N",
        "loading rates": "not known" if rates is None else f"{rates[0]:g} to {rates[1]:g} N/s",
        "delay": f"{calibration.delay_s:g} s between the reading and load logs, not compensated",
        "calibrated": calibration.created or "date not known",
        "identified by": f"smartshoe {calibration.smartshoe_version or '(version not known)'}",
        "exported by": f"smartshoe {__version__}",
    }
    for number, source in enumerate(calibration.sources, start=1):
        said[f"source {number}"] = f"{source.get('name') or '(unnamed)'}, sha256 {source.get('sha256') or 'not known'}"
    return {key: one_safe_line(text) for key, text in said.items()}
