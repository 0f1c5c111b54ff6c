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
