"""The baseline's grid, the sign of its gain and its wall's ratio, against written-out least squares."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from told_columns import MODEL, SCALE, STANDARD, STEP_S, past_columns, session_under, sessions_under, some_load

from smartshoe import Recording
from smartshoe.diagnosis._baseline import (
    SHARE,
    USUAL,
    _wall_ratio,
    baseline_of,
    has_negative_gain,
    poles_per_s,
    with_usual_arm,
)
from smartshoe.diagnosis._likelihood import within_bounds
from smartshoe.diagnosis._prepared import prepared
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._sensitivity import (
    lagged,
)
from smartshoe.diagnosis._session import prepare
from smartshoe.integrity import examine
from smartshoe.models.core import USUAL_WALL_RATIO
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import VOLT

Array = NDArray[np.float64]


def _slow_baseline(sessions: list[Any]) -> tuple[float, float, float]:
    best = (math.inf, 0.0, 0.0, 0.0)
    for pole in np.geomspace(0.01, 50.0, 35):
        rows = []
        for one in (one for one in sessions if one.fitted.any()):
            load = one.conditions.load
            kept = one.fitted
            seen = np.column_stack([one.reading, load, lagged(load, STEP_S, 1.0 / pole)])[kept]
            past = past_columns(one, pole)[kept]
            rows.append(seen - past @ np.linalg.lstsq(past, seen, rcond=1e-10)[0])
        whole = np.concatenate(rows)
        fast, slow = np.linalg.lstsq(whole[:, 1:], whole[:, 0], rcond=None)[0]
        ends = max(-0.9, 0.01 / pole - 1.0), min(50.0, 50.0 / pole - 1.0)
        for share in (slow / fast,) if ends[0] <= slow / fast <= ends[1] else ends:
            column = (whole[:, 1:2] + share * whole[:, 2:]) / (1.0 + share)
            (total,), square, *_ = np.linalg.lstsq(column, whole[:, 0], rcond=None)
            if total > 0.0:
                best = min(best, (float(square[0]), total, share, pole))
    _, total, share, pole = best
    return total, share, pole * (1.0 + share)


@pytest.mark.parametrize(("share", "rate"), [(0.1, 0.3), (0.5, 2.0), (-0.3, 0.5), (1.5, 0.1)])
def test_the_baseline_is_the_best_of_written_out_least_squares(share: float, rate: float) -> None:
    sessions = sessions_under(replace(MODEL, relaxing_share=share, relaxation_rate_per_s=rate), noise=0.003)
    sessions.append(session_under(some_load(60, 8), np.zeros(60), lost=1.1))
    found = baseline_of(sessions, SCALE)
    told = found.gain, found.relaxing_share, found.relaxation_rate_per_s
    assert told == pytest.approx(_slow_baseline(sessions), rel=1e-5)
    assert (found.full_scale_load_n, found.full_scale_reading, found.reading_unit) == (800.0, 140.0, "mbar")
    assert found.wall_ratio == USUAL_WALL_RATIO


@pytest.mark.parametrize(("fast", "slow"), [(0.1, 2.0), (5.0, -4.9)])
def test_a_share_beyond_what_a_wall_can_have_is_held_at_its_bound(fast: float, slow: float) -> None:
    sessions = sessions_under(MODEL)
    for one in sessions:
        load = one.conditions.load
        one.reading = fast * load + slow * lagged(load, STEP_S, 1.0 / 0.5)
    found = baseline_of(sessions, SCALE)
    told = found.gain, found.relaxing_share, found.relaxation_rate_per_s
    assert SHARE.lower <= found.relaxing_share <= SHARE.upper
    assert told == pytest.approx(_slow_baseline(sessions), rel=1e-5)


def _lagging_sessions(lag_s: float) -> list[Any]:
    """Of a sensor that does nothing but lag, by two equal poles."""
    sessions = sessions_under(MODEL)
    for one in sessions:
        one.reading = lagged(lagged(one.conditions.load, STEP_S, 0.5 * lag_s), STEP_S, 0.5 * lag_s)
    return sessions


@pytest.mark.parametrize("lag_s", [0.5, 1.0, 2.0])
def test_a_fit_begins_at_the_solid_that_was_weighed_also_where_the_reading_is_late(lag_s: float) -> None:
    """A reading that is late asks for a share and a rate without end, of which a fit would cut the rate alone."""
    found = baseline_of(_lagging_sessions(lag_s), SCALE)
    assert within_bounds(found).theta == pytest.approx(found.theta, rel=1e-12)


@pytest.mark.parametrize("lag_s", [0.1, 0.3, 1.0])
def test_a_sensor_that_only_lags_is_followed_as_closely_as_by_least_squares(lag_s: float) -> None:
    """Up to 98 % may relax, whatever the pole, so that none of the grid's poles is better at any share."""
    sessions = _lagging_sessions(lag_s)
    found = baseline_of(sessions, SCALE)
    for pole in poles_per_s(1.0)[10:]:
        for share in (0.5, 5.0, 20.0, SHARE.upper):
            other = replace(MODEL, relaxing_share=share, relaxation_rate_per_s=float(pole) * (1.0 + share))
            assert _squares(found, sessions) <= 1.001 * _squares(other, sessions)


def _squares(model: ExtendedModel, sessions: list[Any]) -> float:
    """Of what a solid leaves of all sessions at its best gain, each session's offset and past taken off."""
    share, pole = model.relaxing_share, model.pole_per_s
    parts = np.zeros((2, 2))
    for one in sessions:
        load, time_s = one.conditions.load, one.conditions.time_s - one.conditions.time_s[0]
        made = (load + share * lagged(load, STEP_S, 1.0 / pole)) / (1.0 + share)
        own = np.column_stack([np.ones(load.size), np.exp(-pole * time_s)])
        both = np.column_stack([one.reading, made])
        both = both - own @ np.linalg.lstsq(own, both)[0]
        parts += both.T @ both
    return float(parts[0, 0] - parts[0, 1] ** 2 / parts[1, 1])


def test_a_unit_that_is_slower_than_its_load_is_not_turned_over() -> None:
    """Under three steps it rises still where the load has fallen; its static gain tells its sign."""
    time_s = 0.2 * np.arange(180)
    load_n = np.select([time_s < 1.0, time_s < 15.0, time_s < 30.0], [0.0, 80.0, 20.0], 70.0)
    heated = 20.0 + 0.9 * lagged(lagged(load_n, 0.2, 18.0), 0.2, 1.0)
    for sign in (1.0, -1.0):
        one = Recording.from_arrays(time_s=time_s, force_n=load_n, heater_v=sign * heated)
        usable = [np.ones(len(one), dtype=bool)]
        scale = full_scale([one], usable, STANDARD)
        assert scale.reading * sign < 0.0  # what goes together at once tells the other sign
        sessions = prepare([one], usable, None, scale, [1], STANDARD)
        assert has_negative_gain(sessions, STANDARD)
        assert not has_negative_gain([replace(one, reading=-one.reading) for one in sessions], STANDARD)
        assert prepared([one], 1, examine([one], STANDARD), STANDARD).scale.reading * sign > 0.0


def test_a_sign_that_tells_little_stays_as_it_is() -> None:
    sessions = sessions_under(MODEL, noise=0.0)
    for sign, is_turned in ((1.0, False), (-1.0, True)):
        for one in sessions:
            one.reading = sign * one.conditions.load
        assert has_negative_gain(sessions, STANDARD) is is_turned
    rng = np.random.default_rng(1)
    for one in sessions:
        one.reading = rng.standard_normal(one.reading.size) - 0.1 * one.conditions.load
    assert not has_negative_gain(sessions, STANDARD)


def test_a_reading_that_falls_under_load_has_a_plain_baseline() -> None:
    sessions = sessions_under(MODEL, noise=0.0)
    for one in sessions:
        one.reading = -one.conditions.load
    found = baseline_of(sessions, SCALE)
    assert (found.gain, found.relaxing_share, found.relaxation_rate_per_s) == (1.0, 0.0, 0.2)
    usual = with_usual_arm(found)
    assert (usual.gain, usual.relaxing_share, usual.relaxation_rate_per_s) == (1.0, 0.08, 0.22)
    # A unit as the paper's are: what a held full scale of 800 N reads is all of it.
    assert (USUAL.gain, USUAL.full_scale_load_n, USUAL.full_scale_reading) == (1.0, 800.0, 100.0)
    assert poles_per_s(1.0)[[0, -1]] == pytest.approx([0.01, 50.0])
    assert poles_per_s(20.0)[[0, -1]] == pytest.approx([0.0005, 50.0])


@pytest.mark.parametrize(("ratio", "is_told"), [(1.019, False), (1.021, True), (49.9, True), (50.1, False)])
def test_a_declared_area_tells_the_walls_ratio_within_what_can_be(ratio: float, is_told: bool) -> None:
    pascal_per_newton = 1.1 * 140.0 * 100.0 / 800.0
    area = {"effective_area_m2": str(1.0 / (ratio * pascal_per_newton))}
    recording = Recording.from_arrays(
        time_s=np.arange(3.0), force_n=np.ones(3), pressure_mbar=np.ones(3), metadata=area
    )
    session: Any = SimpleNamespace(recording=recording)
    found = _wall_ratio([session], 1.1, SCALE)
    assert found == pytest.approx(ratio if is_told else USUAL_WALL_RATIO)
    assert _wall_ratio([session], 1.1, replace(SCALE, unit=VOLT)) == USUAL_WALL_RATIO
    # One recording of the unit says it for all, wherever it stands among them.
    bare: Any = SimpleNamespace(recording=replace(recording, metadata={}))
    for sessions in ([bare, session], [session, bare], [bare, session, bare]):
        assert _wall_ratio(sessions, 1.1, SCALE) == found
    assert _wall_ratio([bare, bare], 1.1, SCALE) == USUAL_WALL_RATIO
