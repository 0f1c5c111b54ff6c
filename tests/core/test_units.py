"""Units: what texts mean, and conversions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.errors import UnitError
from smartshoe.units import _TABLE, declared, find_unit, unit, unit_of_suffix


@pytest.mark.parametrize(
    ("text", "symbol"),
    [("(kN)", "kN"), ("[mbar]", "mbar"), ("sec", "s"), ("SEC", "s"), ("Newtons", "N"), ("毫米", "mm"), ("℃", "°C"),
     ("mN", "mN"), ("MPa", "MPa"), ("k", "K"), ("mbar ", "mbar")],
)  # fmt: skip
def test_header_texts_are_understood(text: str, symbol: str) -> None:
    assert unit(text).symbol == symbol


def test_unknown_text_is_refused_by_name() -> None:
    assert find_unit("furlong") is None
    with pytest.raises(UnitError, match="furlong"):
        unit("furlong")
    assert declared("furlong").quantity == "unknown"


def test_each_suffix_leads_back_to_its_own_unit() -> None:
    for symbol, suffix, *_ in _TABLE:
        found = unit_of_suffix(suffix)
        assert found is not None
        assert found.symbol == symbol


@given(st.sampled_from([row[0] for row in _TABLE]), st.floats(-1e6, 1e6, allow_subnormal=False))
def test_to_si_and_back_is_the_same_number(symbol: str, value: float) -> None:
    there = unit(symbol)
    back = there.from_si(there.to_si([value]))
    # Relative to the offset too: 273.15 K swallows the last digits of a tiny temperature.
    assert back[0] == pytest.approx(
        value, rel=1e-14, abs=4 * np.spacing(there.offset / there.scale + abs(value)) + 1e-300
    )


def test_other_quantities_do_not_convert() -> None:
    with pytest.raises(UnitError, match="pressure"):
        unit("mbar").convert([1.0], unit("N"))


_STANDARD_GRAVITY, _POUND_KG, _INCH_M = 9.80665, 0.45359237, 0.0254  # exact by definition


@pytest.mark.parametrize(
    ("amount", "symbol", "si"),
    [(1.0, "psi", _POUND_KG * _STANDARD_GRAVITY / _INCH_M**2), (760.0, "mmHg", 101325.0), (1.0, "atm", 101325.0),
     (1.0, "bar", 1e5), (1000.0, "mbar", 1e5), (1000.0, "hPa", 1e5), (100.0, "kPa", 1e5), (0.1, "MPa", 1e5),
     (29.921, "inHg", 101325.0), (1.0, "kgf/cm2", _STANDARD_GRAVITY * 1e4),
     (1.0, "cmH2O", _STANDARD_GRAVITY * 10.0), (1.0, "lbf", _POUND_KG * _STANDARD_GRAVITY),
     (1.0, "kgf", _STANDARD_GRAVITY), (1000.0, "gf", _STANDARD_GRAVITY), (1.0, "kN", 1e3), (1.0, "daN", 10.0),
     (1.0, "mN", 1e-3), (1.0, "psi·cm²", _POUND_KG * _STANDARD_GRAVITY * 1e-4 / _INCH_M**2), (1.0, "bar·cm²", 10.0),
     (1.0, "in", _INCH_M), (60.0, "mm/min", 1e-3), (180.0, "deg", np.pi), (20.0, "°C", 293.15), (1.0, "h", 3600.0)],
)  # fmt: skip
def test_units_are_as_large_as_their_definitions_say(amount: float, symbol: str, si: float) -> None:
    # inHg is of mercury at 0 °C, known to five digits; mmHg and the standard atmosphere agree to seven.
    assert unit(symbol).to_si([amount])[0] == pytest.approx(si, rel=2e-5 if symbol == "inHg" else 1e-6)
