"""Units: what texts mean, and conversions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.errors import UnitError
from smartshoe.units import _TABLE, declared, find_unit, on_one_cm2, unit, unit_of_suffix


@pytest.mark.parametrize(
    ("text", "symbol"),
    [("(kN)", "kN"), ("[mbar]", "mbar"), ("sec", "s"), ("SEC", "s"), ("Newtons", "N"), ("毫米", "mm"), ("℃", "°C"),
     ("mN", "mN"), ("MPa", "MPa"), ("k", "K"), ("mbar ", "mbar"),
     ("MN", "MN"), ("mPa", "mPa"), ("mpa", "MPa"), ("mΩ", "mohm"), ("MΩ", "Mohm"), ("KPA", "kPa"), ("MBAR", "mbar")],
)  # fmt: skip
def test_header_texts_are_understood(text: str, symbol: str) -> None:
    assert unit(text).symbol == symbol


def test_unknown_text_is_refused_by_name() -> None:
    assert find_unit("furlong") is None
    with pytest.raises(UnitError, match="furlong"):
        unit("furlong")
    assert declared("furlong").quantity == "unknown"


def test_a_load_in_kilograms_is_one_in_kilograms_force() -> None:
    assert unit_of_suffix("kg") == find_unit("(kg)") == unit("kgf")


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


def test_temperatures_convert_by_their_zeros_too() -> None:
    assert unit("°C").convert([20.0, -273.15], unit("K")) == pytest.approx([293.15, 0.0])
    assert unit("K").convert([273.15], unit("degc"))[0] == pytest.approx(0.0, abs=1e-12)
    assert unit("kN").convert([1.5], unit("N"))[0] == 1500.0


def test_values_in_si_are_not_copied_and_others_are() -> None:
    values = np.ones(3)
    assert unit("N").to_si(values) is values
    assert unit("N").from_si(values) is values
    for symbol in ("kN", "°C"):
        assert not np.shares_memory(unit(symbol).to_si(values), values)
        assert not np.shares_memory(unit(symbol).from_si(values), values)


def test_other_quantities_do_not_convert() -> None:
    with pytest.raises(UnitError, match="pressure"):
        unit("mbar").convert([1.0], unit("N"))


_STANDARD_GRAVITY, _POUND_KG, _INCH_M = 9.80665, 0.45359237, 0.0254  # exact by definition


_DEFINED = (
    (1.0, "psi", _POUND_KG * _STANDARD_GRAVITY / _INCH_M**2), (760.0, "mmHg", 101325.0), (1.0, "atm", 101325.0),
    (1.0, "bar", 1e5), (1000.0, "mbar", 1e5), (1000.0, "hPa", 1e5), (100.0, "kPa", 1e5), (0.1, "MPa", 1e5),
    (29.921, "inHg", 101325.0), (1.0, "kgf/cm2", _STANDARD_GRAVITY * 1e4), (1.0, "Pa", 1.0),
    (1.0, "cmH2O", _STANDARD_GRAVITY * 10.0), (1.0, "lbf", _POUND_KG * _STANDARD_GRAVITY), (1.0, "N", 1.0),
    (1.0, "kgf", _STANDARD_GRAVITY), (1000.0, "gf", _STANDARD_GRAVITY), (1.0, "kN", 1e3), (1.0, "daN", 10.0),
    (1.0, "MN", 1e6), (1000.0, "mPa", 1.0), (1000.0, "mohm", 1.0),
    (1.0, "mN", 1e-3), (1.0, "uN", 1e-6), (1.0, "nN", 1e-9),
    (1.0, "s", 1.0), (1.0, "ms", 1e-3), (1.0, "us", 1e-6), (1.0, "min", 60.0), (1.0, "h", 3600.0),
    (1.0, "m", 1.0), (1.0, "cm", 1e-2), (1.0, "mm", 1e-3), (1.0, "um", 1e-6), (1.0, "in", _INCH_M),
    (60.0, "mm/min", 1e-3), (1.0, "m/s", 1.0), (1.0, "mm/s", 1e-3), (1.0, "m/s^2", 1.0), (1.0, "N/s", 1.0),
    (180.0, "deg", np.pi), (1.0, "rad", 1.0), (20.0, "°C", 293.15), (1.0, "K", 1.0), (1.0, "Hz", 1.0),
    (1.0, "V", 1.0), (1.0, "mV", 1e-3), (1.0, "uV", 1e-6), (1.0, "mV/V", 1e-3), (1.0, "A", 1.0), (1.0, "mA", 1e-3),
    (1.0, "ohm", 1.0), (1.0, "kohm", 1e3), (1.0, "Mohm", 1e6), (1.0, "pF", 1e-12), (1.0, "nF", 1e-9),
    (1.0, "counts", 1.0), (100.0, "%", 1.0), (1.0, "mm/mm", 1.0), (1.0, "1", 1.0),
)  # fmt: skip


@pytest.mark.parametrize(("amount", "symbol", "si"), _DEFINED)
def test_units_are_as_large_as_their_definitions_say(amount: float, symbol: str, si: float) -> None:
    # inHg is of mercury at 0 °C, known to five digits; mmHg and the standard atmosphere agree to seven.
    assert unit(symbol).to_si([amount])[0] == pytest.approx(si, rel=2e-5 if symbol == "inHg" else 1e-6, abs=0.0)
    assert unit(symbol).to_si([0.0])[0] == (273.15 if symbol == "°C" else 0.0)


def test_every_unit_has_its_definition_and_every_pressure_its_force_on_one_cm2() -> None:
    defined = {symbol for _, symbol, _ in _DEFINED}
    for symbol, _, quantity, *_ in _TABLE:
        assert symbol.removesuffix("·cm²") in defined
        if quantity == "pressure":
            on_1_cm2 = on_one_cm2(unit(symbol))
            assert on_1_cm2.quantity == "force"
            assert on_1_cm2.to_si([3.0])[0] == pytest.approx(3e-4 * unit(symbol).to_si([1.0])[0], rel=1e-12)


def test_values_of_a_unit_that_is_not_known_stay_as_they_are() -> None:
    furlongs = declared("furlong")
    assert furlongs.to_si([2.5])[0] == furlongs.from_si([2.5])[0] == 2.5
    assert furlongs.convert([2.5], declared("furlong"))[0] == 2.5
    with pytest.raises(UnitError, match="furlong"):
        furlongs.convert([2.5], unit("m"))


@given(st.sampled_from(_TABLE), st.sampled_from(_TABLE), st.floats(-1e3, 1e3))
def test_any_unit_converts_to_any_other_of_its_quantity_by_way_of_si(
    one: tuple[str, ...], other: tuple[str, ...], value: float
) -> None:
    ours, theirs = unit(one[0]), unit(other[0])
    if ours.quantity != theirs.quantity:
        with pytest.raises(UnitError, match="cannot be expressed"):
            ours.convert([value], theirs)
        return
    there = ours.convert([value], theirs)
    assert there[0] == pytest.approx(theirs.from_si(ours.to_si([value]))[0], rel=1e-12, abs=1e-9)
    assert theirs.to_si(there)[0] == pytest.approx(ours.to_si([value])[0], rel=1e-12, abs=1e-9)


def test_a_pressure_converts_to_each_other_pressure() -> None:
    pressures = [unit(row[0]) for row in _TABLE if row[2] == "pressure"]
    for ours in pressures:
        for theirs in pressures:
            assert ours.convert([2.0], theirs)[0] == pytest.approx(2.0 * ours.scale / theirs.scale)


@pytest.mark.parametrize(("symbol", "suffix"), [(" Big Blobs ", "big_blobs"), ("", "1"), ("  ", "1")])
def test_a_unit_that_is_not_known_has_an_ending_for_its_column(symbol: str, suffix: str) -> None:
    assert (declared(symbol).symbol, declared(symbol).suffix) == (symbol, suffix)
