"""Units of measurement: parsed from headers, and converted to SI."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import UnitError

DAY_S = 86400.0


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: ``si = value * scale + offset``.

    ``symbol`` is its display form, ``suffix`` the ending of a column's name.
    """

    symbol: str
    suffix: str
    quantity: str
    scale: float = 1.0
    offset: float = 0.0

    def to_si(self, values: ArrayLike) -> Array:
        """Values of this unit converted to the quantity's SI unit (a new array unless the unit is SI)."""
        array = np.asarray(values, dtype=float)
        if self.scale == 1.0 and self.offset == 0.0:
            return array
        return array * self.scale + self.offset

    def from_si(self, values: ArrayLike) -> Array:
        """SI values converted to this unit."""
        array = np.asarray(values, dtype=float)
        if self.scale == 1.0 and self.offset == 0.0:
            return array
        return (array - self.offset) / self.scale

    def convert(self, values: ArrayLike, to: Unit) -> Array:
        """Values of this unit converted to unit ``to``; raises `UnitError` between different quantities."""
        if to == self:
            return np.asarray(values, dtype=float)
        if to.quantity != self.quantity:
            raise UnitError(f"{self.symbol} ({self.quantity}) cannot be expressed in {to.symbol} ({to.quantity})")
        if self.offset == 0.0 and to.offset == 0.0:
            return np.asarray(values, dtype=float) * (self.scale / to.scale)
        return to.from_si(self.to_si(values))


_TABLE: list[tuple[str, str, str, float, float, tuple[str, ...]]] = [
    ("s", "s", "time", 1.0, 0.0, ("sec", "secs", "second", "seconds", "sek", "sekunden", "秒")),
    ("ms", "ms", "time", 1e-3, 0.0, ("msec", "millis", "millisecond", "milliseconds", "毫秒")),
    ("us", "us", "time", 1e-6, 0.0, ("µs", "usec", "micros")),
    ("min", "min", "time", 60.0, 0.0, ("minute", "minutes", "分")),
    ("h", "h", "time", 3600.0, 0.0, ("hour", "hours")),
    ("N", "n", "force", 1.0, 0.0, ("newton", "newtons", "牛", "牛顿")),
    ("kN", "kn", "force", 1e3, 0.0, ("kilonewton", "千牛")),
    ("mN", "millinewton", "force", 1e-3, 0.0, ()),
    ("uN", "micronewton", "force", 1e-6, 0.0, ("µN",)),
    ("nN", "nanonewton", "force", 1e-9, 0.0, ()),
    ("MN", "meganewton", "force", 1e6, 0.0, ()),
    ("daN", "dan", "force", 10.0, 0.0, ()),
    ("kgf", "kgf", "force", 9.80665, 0.0, ("kp", "kg", "公斤力")),  # a load cell may be scaled in units of mass
    ("gf", "gf", "force", 9.80665e-3, 0.0, ()),
    ("lbf", "lbf", "force", 4.4482216152605, 0.0, ("lb", "lbs")),
    ("Pa", "pa", "pressure", 1.0, 0.0, ("pascal", "帕")),
    ("hPa", "hpa", "pressure", 100.0, 0.0, ()),
    ("kPa", "kpa", "pressure", 1e3, 0.0, ("千帕",)),
    ("MPa", "megapascal", "pressure", 1e6, 0.0, ("n/mm^2", "n/mm2", "兆帕")),
    ("mPa", "millipascal", "pressure", 1e-3, 0.0, ()),
    ("mbar", "mbar", "pressure", 100.0, 0.0, ("毫巴",)),
    ("bar", "bar", "pressure", 1e5, 0.0, ("巴",)),
    ("psi", "psi", "pressure", 6894.757293168, 0.0, ()),
    ("mmHg", "mmhg", "pressure", 133.322387415, 0.0, ("torr",)),
    ("cmH2O", "cmh2o", "pressure", 98.0665, 0.0, ()),
    ("inHg", "inhg", "pressure", 3386.389, 0.0, ()),
    ("atm", "atm", "pressure", 101325.0, 0.0, ()),
    ("kgf/cm2", "kgf_per_cm2", "pressure", 98066.5, 0.0, ("kg/cm2",)),
    ("m", "m", "length", 1.0, 0.0, ("meter", "metre", "米")),
    ("cm", "cm", "length", 1e-2, 0.0, ("厘米",)),
    ("mm", "mm", "length", 1e-3, 0.0, ("millimeter", "millimetre", "毫米")),
    ("um", "um", "length", 1e-6, 0.0, ("µm",)),
    ("in", "in", "length", 0.0254, 0.0, ("inch", "inches")),
    ("K", "k", "temperature", 1.0, 0.0, ("kelvin",)),
    ("°C", "c", "temperature", 1.0, 273.15, ("degc", "deg c", "celsius", "℃", "摄氏度")),
    ("V", "v", "voltage", 1.0, 0.0, ("volt", "volts", "伏")),
    ("mV", "mv", "voltage", 1e-3, 0.0, ("millivolt", "毫伏")),
    ("uV", "uv", "voltage", 1e-6, 0.0, ("µV",)),
    ("mV/V", "mv_per_v", "ratio", 1e-3, 0.0, ()),
    ("A", "a", "current", 1.0, 0.0, ("ampere",)),
    ("mA", "ma", "current", 1e-3, 0.0, ()),
    ("ohm", "ohm", "resistance", 1.0, 0.0, ("Ω", "ohms")),
    ("kohm", "kohm", "resistance", 1e3, 0.0, ("kΩ",)),
    ("Mohm", "megaohm", "resistance", 1e6, 0.0, ("MΩ",)),
    ("mohm", "milliohm", "resistance", 1e-3, 0.0, ("mΩ",)),
    ("pF", "pf", "capacitance", 1e-12, 0.0, ()),
    ("nF", "nf", "capacitance", 1e-9, 0.0, ()),
    ("rad", "rad", "angle", 1.0, 0.0, ()),
    ("deg", "deg", "angle", 0.017453292519943295, 0.0, ("°",)),
    ("counts", "counts", "counts", 1.0, 0.0, ("count", "cnt", "lsb", "adc")),
    ("m/s", "m_per_s", "velocity", 1.0, 0.0, ()),
    ("mm/s", "mm_per_s", "velocity", 1e-3, 0.0, ()),
    ("mm/min", "mm_per_min", "velocity", 1e-3 / 60.0, 0.0, ()),
    ("N/s", "n_per_s", "force rate", 1.0, 0.0, ()),
    ("m/s^2", "m_per_s2", "acceleration", 1.0, 0.0, ("m/s2", "m/s²")),
    ("Hz", "hz", "frequency", 1.0, 0.0, ()),
    ("%", "percent", "ratio", 1e-2, 0.0, ("percent",)),
    ("mm/mm", "mm_per_mm", "ratio", 1.0, 0.0, ()),
    ("1", "1", "dimensionless", 1.0, 0.0, ("-", "a.u.", "au")),
]
# For a sensor pressed all over, the reference may be a pressure: it becomes the force on 1 cm².
_TABLE += [
    (f"{symbol}·cm²", f"{suffix}_cm2", "force", 1e-4 * scale, 0.0, ())
    for symbol, suffix, quantity, scale, _, _ in _TABLE
    if quantity == "pressure"
]

# Symbols are case sensitive where case carries meaning (mN and MN, mΩ and MΩ); everything else is not.
_BY_SYMBOL: dict[str, Unit] = {}
_BY_WORD: dict[str, Unit] = {}
_BY_SUFFIX: dict[str, Unit] = {}
for _symbol, _suffix, _quantity, _scale, _offset, _words in _TABLE:
    _unit = Unit(_symbol, _suffix, _quantity, _scale, _offset)
    _BY_SYMBOL[unicodedata.normalize("NFKC", _symbol)] = _unit
    _BY_SUFFIX[_suffix] = _unit
    _BY_WORD.setdefault(unicodedata.normalize("NFKC", _symbol).casefold(), _unit)
    for _word in _words:
        _BY_SYMBOL.setdefault(unicodedata.normalize("NFKC", _word), _unit)
        _BY_WORD.setdefault(unicodedata.normalize("NFKC", _word).casefold(), _unit)
_BY_SUFFIX["kg"] = _BY_SUFFIX["kgf"]  # like a header's "(kg)", since no channel here is a mass
_BY_SUFFIX |= {word: unit for word, unit in _BY_WORD.items() if unit.quantity == "time"}  # timestamp_seconds


def find_unit(text: str) -> Unit | None:
    """The unit that a header's text names (``(kN)``, ``[mbar]``, ``sec``, ``毫米``), or None if it is unknown."""
    plain = unicodedata.normalize("NFKC", text).strip().strip("()[]{}").strip()
    if not plain:
        return None
    return _BY_SYMBOL.get(plain) or _BY_WORD.get(plain.casefold())


def unit(text: str) -> Unit:
    """The unit that ``text`` names; raises `UnitError` if it is unknown."""
    found = find_unit(text)
    if found is None:
        raise UnitError(f"unit {text!r} is not known: use one of {', '.join(row[0] for row in _TABLE)}")
    return found


def on_one_cm2(pressure: Unit) -> Unit:
    """The unit of the force that one unit of ``pressure`` exerts on 1 cm²: bar·cm² (10 N) for bar."""
    return unit(f"{pressure.symbol}·cm²")


def unit_of_suffix(suffix: str) -> Unit | None:
    """The unit of a column's suffix, as in ``pressure_mbar`` or ``load_mN``; None where it is not a unit."""
    return _BY_SUFFIX.get(suffix.casefold()) or _BY_SYMBOL.get(suffix)


def declared(symbol: str) -> Unit:
    """A unit that the table lacks, kept with its symbol (its quantity is ``unknown``)."""
    return Unit(symbol, symbol.strip().casefold().replace(" ", "_") or "1", "unknown")


SECOND, NEWTON, PASCAL, MILLIBAR = unit("s"), unit("N"), unit("Pa"), unit("mbar")
VOLT, COUNTS, ONE = unit("V"), unit("counts"), unit("1")
