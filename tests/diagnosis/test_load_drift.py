"""A zero that moves in the load cell is told from one that moves in the reading, by what the rests show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_known_units import PEAK_N, TRIANGLES_N, _run, _solid
from told_columns import MODEL, STANDARD, STEP_S, Array, session_under

from smartshoe import diagnose
from smartshoe.diagnosis._load_drift import may_be_of_the_load_cell
from smartshoe.models.effects import Conditions, effect

SIZE = 1200
PER_SAMPLE = np.arange(SIZE) / SIZE
BORNE = np.interp(np.arange(SIZE) % 200, [0, 100, 150, 200], [0.0, 0.0, 1.0, 0.0])  # rests of ten seconds


def _asked(load: Array, drift: float) -> bool:
    """Whether a drift of the zero, a share of full scale in all, may be the load cell's that logs ``load`` (n,)."""
    named = effect("zero_drift")
    values = named.start({})
    values[0] = drift / (SIZE * STEP_S)
    model = MODEL.with_part(named.name, values)
    session = session_under(load, model.simulate(Conditions(STEP_S * np.arange(SIZE), load, STEP_S)))
    session.resting = BORNE == 0.0
    name: Any = SimpleNamespace(member=SimpleNamespace(name=named.name), effect=named)
    return may_be_of_the_load_cell(name, model, [session], STANDARD)


@pytest.mark.parametrize(
    ("share", "is_cells"), [(1.0, True), (0.7, True), (0.3, False), (0.0, False), (-1.0, False), (3.0, False)]
)
@given(st.floats(0.002, 0.03), st.sampled_from([-1.0, 1.0]))
def test_it_is_the_load_cells_where_the_load_at_rest_moves_as_the_drift_has_it(
    share: float, is_cells: bool, drift: float, way: float
) -> None:
    """``share`` of what the drift takes the reading by shows in the load at rest, turned over."""
    logged = BORNE - way * share * drift / MODEL.gain * PER_SAMPLE
    assert _asked(logged, way * drift) is is_cells


def test_a_drift_that_rests_do_not_show_is_nobodys() -> None:
    assert not _asked(BORNE - 1e-4 / MODEL.gain * PER_SAMPLE, 1e-4)  # less than counts for anything


@pytest.mark.parametrize("is_cells", [True, False])
def test_a_load_cell_that_drifts_leaves_the_zero_drift_half_sure(is_cells: bool) -> None:
    """One newton of fifty in a minute and a half; the same in the reading alone is over 95 % sure."""
    drift_n = 0.02 * PEAK_N * np.arange(TRIANGLES_N.size) / TRIANGLES_N.size
    logged = TRIANGLES_N + (drift_n if is_cells else 0.0)
    reading = _solid(TRIANGLES_N, 5.0) - (0.0 if is_cells else 1.0) * drift_n
    found = diagnose([_run(logged, reading, "unit", 0.03)])
    (cause,) = found.causes
    assert cause.name in {"zero_drift", "warm_up"}
    said = [str(one) for one in found.limits if "at rest the logged load moves" in str(one)]
    assert len(said) == is_cells
    assert (cause.confidence <= 0.5) is is_cells
    assert is_cells or cause.confidence > 0.95
