"""What a fit is given: each condition of an option and of a recording at its bound and beside it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import press
from scipy.special import gammaincc

from smartshoe.arrays import require_positive
from smartshoe.errors import InputError, NotIdentifiableError, UsageError
from smartshoe.identification import consistency_test, identify
from smartshoe.identification._consistency import ConsistencyTest
from smartshoe.identification._experiment import (
    Experiment,
    _largest_rises,
    _on_one_step,
    _require_identifiable,
    block_means,
    prepare,
)
from smartshoe.identification._identifier import (
    _check_choices,
    _fixed,
    _form,
    _scale,
    _sd,
    _settings,
    _unit_name,
)
from smartshoe.identification._parametrisation import GREY_FIXED, FreeForm, GreyBox
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR, find_unit

Array = NDArray[np.float64]


# -- options ---------------------------------------------------------------------------------------------------------
def test_positive_numbers_are_finite_and_above_nothing() -> None:
    for number in (1e-300, 0.5, 1e300):
        assert require_positive(number, "one") == number
    for number in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(UsageError, match=r"two is .*: give a positive number"):
            require_positive(number, "two")


def test_a_number_or_the_word_estimate() -> None:
    assert _fixed("offset", "estimate") is None
    assert (_fixed("offset", 0.0), _fixed("offset", -3.5), _fixed("offset", 2)) == (0.0, -3.5, 2.0)
    for value in ("free", np.nan, np.inf):
        with pytest.raises(UsageError, match="offset is"):
            _fixed("offset", value)
    assert (_sd("load_noise_n", "estimate"), _sd("load_noise_n", 0.0), _sd("load_noise_n", 0.5)) == (None, 0.0, 0.5)
    with pytest.raises(UsageError, match=r"load_noise_n is -0\.1"):
        _sd("load_noise_n", -0.1)


CHOICES = {
    "direction": "inverse", "method": "trf", "structure": "free", "initial_state": "estimate", "estimator": "auto"
}  # fmt: skip


def test_choices_are_those_that_are_named() -> None:
    _check_choices(**CHOICES)
    for name in CHOICES:
        with pytest.raises(UsageError, match=f"{name} 'none' is not known"):
            _check_choices(**{**CHOICES, name: "none"})
    for method, structure, estimator, is_right in (
        ("srivc", "free", "output_error", True),
        ("srivc", "free", "auto", True),
        ("srivc", "free", "cycles", False),
        ("srivc", "grey_box", "auto", False),
        ("gn", "grey_box", "command", True),
    ):
        own = {**CHOICES, "method": method, "structure": structure, "estimator": estimator}
        if is_right:
            _check_choices(**own)
        else:
            with pytest.raises(UsageError, match="srivc"):
                _check_choices(**own)


@pytest.mark.parametrize(
    ("offset", "load_offset_n", "constant"),
    [("estimate", 0.0, True), (0.0, "estimate", True), (4.0, 7.0, False), ("estimate", 7.0, True)],
)
def test_one_of_two_zeros_is_free_or_none(offset: Any, load_offset_n: Any, constant: bool) -> None:
    found = _settings("forward", offset, load_offset_n, 0.5, "steady")
    assert found.free_constant is constant
    assert found.offset == (None if offset == "estimate" else offset)
    assert found.load_offset_n == (0.0 if load_offset_n == "estimate" else load_offset_n)
    assert (found.direction, found.delay_s, found.steady, found.noise_ratio) == ("forward", 0.5, True, 0.0)
    other = _settings("inverse", offset, load_offset_n, "estimate", "estimate")
    assert (other.delay_s, other.steady) == (None, False)


def test_zeros_and_delays_beyond_what_can_be_found_are_refused() -> None:
    with pytest.raises(UsageError, match="one number to this model"):
        _settings("inverse", "estimate", "estimate", 0.0, "steady")
    assert _settings("inverse", 0.0, 0.0, -0.5, "steady").delay_s == -0.5
    for delay in (0.501, -0.501):
        with pytest.raises(UsageError, match="delay is"):
            _settings("inverse", 0.0, 0.0, delay, "steady")


def test_a_grey_box_is_one_where_it_has_a_scale() -> None:
    assert _form("free", "forward", 2.0, None, None) == FreeForm("forward")
    assert _form("grey_box", "inverse", None, None, {}) == FreeForm("inverse")
    box = _form("grey_box", "inverse", 2.0, None, {"k1": (0.0, 1.0)})
    assert box == GreyBox("inverse", 2.0, dict(GREY_FIXED), {"k1": (0.0, 1.0)})
    assert _form("grey_box", "inverse", 2.0, {"c": 1.2}, None) == GreyBox("inverse", 2.0, {"c": 1.2}, {})
    for structure, newtons, fixed, bounds in (
        ("free", 2.0, {"c": 1.0}, None),
        ("free", 2.0, None, {"k1": (0.0, 1.0)}),
        ("grey_box", None, {"c": 1.0}, None),
    ):
        with pytest.raises(UsageError, match="belong to the grey box"):
            _form(structure, "inverse", newtons, fixed, bounds)  # type: ignore[arg-type]


def _of(metadata: dict[str, str] | None = None, **names: str) -> Recording:
    return replace(press(metadata=metadata), **names)  # type: ignore[arg-type]


def test_a_scale_is_given_estimated_or_that_of_the_area() -> None:
    plain = [_of()]
    assert _scale(plain, MILLIBAR, "estimate", "grey_box") == (None, "scale was estimated, with c = 1")
    for wrong in (("estimate", "free"), ("free", "grey_box")):
        with pytest.raises(UsageError, match="scale is"):
            _scale(plain, MILLIBAR, *wrong)
    assert _scale(plain, MILLIBAR, 1, "free") == (1.0, "scale was given by the caller")
    assert _scale(plain, MILLIBAR, -0.25, "free")[0] == -0.25
    for number in (0.0, np.nan, np.inf):
        with pytest.raises(UsageError, match="scale is"):
            _scale(plain, MILLIBAR, number, "free")
    assert _scale(plain, MILLIBAR, None, "free") == (1.0, "scale is 1: the reading is taken in the paper's force units")
    # 1 mbar is 100 N/m2.
    area = {"effective_area_m2": "0.00025"}
    value, says = _scale([_of(area), _of(area)], MILLIBAR, None, "free")
    assert (value, says) == (pytest.approx(0.025), "scale follows from effective_area_m2 = 0.00025")
    assert _scale([_of({"effective_area_m2": "2"})], MILLIBAR, None, "free")[0] == pytest.approx(200.0)
    assert _scale([_of(area), _of({"effective_area_m2": "0.0003"})], MILLIBAR, None, "free")[0] == 1.0
    assert _scale([_of(area), _of()], MILLIBAR, None, "free")[0] == 1.0
    volt = find_unit("V")
    assert volt is not None
    assert _scale([_of(area)], volt, None, "free")[0] == 1.0
    for text in ("large", "0", "-1", "nan", "inf"):
        with pytest.raises(InputError, match="effective_area_m2 is"):
            _scale([_of({"effective_area_m2": text})], MILLIBAR, None, "free")


def test_recordings_are_of_one_unit() -> None:
    assert _unit_name([_of(unit="toe"), _of(unit="toe"), _of(unit="")]) == "toe"
    assert _unit_name([_of(unit="")]) == _of().sensor.name
    with pytest.raises(UsageError, match=r"different units \(heel in [^,]+, toe in [^,)]+\)"):
        _unit_name([_of(unit="toe"), _of(unit="heel")])


def test_sources_are_files_or_names_and_a_first_note_is_of_the_scale() -> None:
    several = [replace(press(name="a"), source="a.csv"), replace(press(name="b"), source="")]
    found = identify(several, offset=0.0, delay=0.0, initial_state="steady")
    assert found.sources == ("a.csv", "b")
    assert found.remarks[0].startswith("scale is 1")
    assert found.load_offsets["b"].value == 0.0


# -- recordings ------------------------------------------------------------------------------------------------------
def course(load: Array, reading: Array | None = None, mask: NDArray[np.bool_] | None = None) -> Experiment:
    time_s = 0.01 * np.arange(load.size)
    kept = np.ones(load.size, dtype=bool) if mask is None else mask
    return Experiment("one", time_s, 0.01, load, load.copy() if reading is None else reading, kept, 0)


def _there_and_back(low: float, high: float, back: float) -> Array:
    return np.concatenate([np.linspace(low, high, 30), np.linspace(high, back, 30)])


RISE = _there_and_back(0.0, 100.0, 0.0)
NAMED = [press(name="first")]


@pytest.mark.parametrize(
    ("load", "says"),
    [
        (RISE, ""),
        (_there_and_back(0.0, 100.0, 90.1), "never falls again"),
        (_there_and_back(0.0, 100.0, 89.9), ""),
        (-_there_and_back(0.0, 100.0, 90.1), "never rises"),
        (-_there_and_back(0.0, 100.0, 89.9), ""),
        # Half of the way back of a load that is large as it is.
        (_there_and_back(900.0, 1000.0, 950.0), ""),
        (np.full(60, 5.0), "load is constant"),
        (np.zeros(60), "load is constant"),
        (1e6 + 0.9e-8 * RISE, "load is constant"),
        (1e6 + 1.5e-8 * RISE, ""),
        (1e-3 * RISE, ""),
    ],
)
def test_a_load_rises_and_falls_by_a_tenth_of_its_range(load: Array, says: str) -> None:
    experiment = course(load, RISE)
    if says:
        with pytest.raises(NotIdentifiableError, match=says):
            _require_identifiable([experiment], NAMED)
    else:
        _require_identifiable([experiment], NAMED)


def test_the_range_is_that_of_all_recordings_and_each_may_rise_or_fall() -> None:
    up, down = np.linspace(0.0, 100.0, 60), np.linspace(500.0, 400.0, 60)
    _require_identifiable([course(up), course(down)], NAMED * 2)
    with pytest.raises(NotIdentifiableError, match="never rises"):
        _require_identifiable([course(up / 3.0), course(down)], NAMED * 2)
    # A level in one recording is none where the other moves.
    _require_identifiable([course(np.full(60, 7.0)), course(RISE)], NAMED * 2)


def test_twenty_samples_are_enough_and_a_refusal_says_of_how_many_recordings() -> None:
    for count, is_enough in ((20, True), (19, False)):
        mask = np.zeros(60, dtype=bool)
        mask[20 : 20 + count] = True
        if is_enough:
            _require_identifiable([course(RISE, mask=mask)], NAMED)
        else:
            with pytest.raises(NotIdentifiableError, match=r"first holds 19 samples"):
                _require_identifiable([course(RISE, mask=mask)], NAMED)
            with pytest.raises(NotIdentifiableError, match=r"first and 1 more holds 19"):
                _require_identifiable([course(RISE, mask=mask)], [*NAMED, press(name="second")])
    with pytest.raises(NotIdentifiableError, match="reading is constant"):
        _require_identifiable([course(RISE, np.full(60, 3.0))], NAMED)


@pytest.mark.parametrize(("samples", "of"), [(3999, 1), (4000, 2), (4001, 2), (6003, 3)])
def test_of_thousands_of_samples_climbs_are_those_of_means(samples: int, of: int) -> None:
    """Of 2000 means about; a spike of one sample counts for as much of itself."""
    signal = np.zeros(samples)
    signal[1200] = 12.0
    assert _largest_rises(signal) == pytest.approx((12.0 / of, 12.0 / of))
    rough = np.random.default_rng(1).standard_normal(samples)
    coarse = block_means(rough, of) if of > 1 else rough
    climbs = np.subtract.outer(coarse, coarse)
    assert _largest_rises(rough) == pytest.approx((float(np.tril(climbs).max()), -float(np.tril(climbs).min())))


# -- rows that a logger skipped --------------------------------------------------------------------------------------
def _logged(places: Array, step_s: float = 0.02) -> Experiment:
    time_s = step_s * places
    load = 3.0 * places
    return Experiment(
        "one", time_s, np.diff(time_s), load, 2.0 * load, np.arange(places.size) != 1, 0, command_n=load + 5.0
    )


def test_skipped_rows_are_put_back_on_lines_and_do_not_count() -> None:
    places = np.array([0.0, 1.0, 2.0, 5.0, 6.0, 8.0])
    found = _on_one_step(_logged(places))
    assert found.step == pytest.approx(0.02)
    assert found.time_s == pytest.approx(0.02 * np.arange(9))
    assert found.load_n == pytest.approx(3.0 * np.arange(9))
    assert found.reading == pytest.approx(6.0 * np.arange(9))
    assert found.command_n == pytest.approx(3.0 * np.arange(9) + 5.0)
    assert found.mask.tolist() == [True, False, True, False, False, True, True, False, True]
    assert found.rows is not None
    assert found.rows.tolist() == [0, 1, 2, 5, 6, 8]
    assert _on_one_step(replace(_logged(places), command_n=None)).command_n is None
    even = replace(_logged(places), step=0.02)
    assert _on_one_step(even) is even


@pytest.mark.parametrize(("last", "is_even"), [(23.0, True), (24.0, False)])
def test_no_more_than_four_times_as_many_samples_are_put_back(last: float, is_even: bool) -> None:
    experiment = _logged(np.array([0.0, 1.0, 2.0, 3.0, 4.0, last]))
    found = _on_one_step(experiment)
    assert isinstance(found.step, float) is is_even
    if not is_even:
        assert found is experiment


def test_steps_shorter_than_half_of_the_usual_one_are_left_as_they_are() -> None:
    experiment = _logged(np.array([0.0, 1.0, 2.0, 2.4, 3.4, 4.4]))
    assert _on_one_step(experiment) is experiment


@pytest.mark.parametrize(("off", "is_even"), [(0.049, True), (0.051, False), (-0.051, False)])
def test_rows_lie_within_a_twentieth_of_a_step_of_their_places(off: float, is_even: bool) -> None:
    places = np.array([0.0, 1.0, 2.0, 5.0, 6.0, 7.0])
    places[2] += off
    found = _on_one_step(_logged(places))
    assert isinstance(found.step, float) is is_even


# -- means -----------------------------------------------------------------------------------------------------------
def test_means_of_two_or_more_blocks_are_a_recording_again() -> None:
    experiment = course(np.arange(12.0))
    for factor, size in ((2, 6), (5, 2), (6, 2)):
        found = experiment.decimated(factor)
        assert found.time_s.size == size
        assert found.step == pytest.approx(0.01 * factor)
        assert found.time_s[0] == pytest.approx(0.005 * (factor - 1))
    for factor in (1, 7, 12):
        assert experiment.decimated(factor) is experiment
    uneven = replace(experiment, time_s=0.01 * np.arange(12.0) ** 2, step=np.diff(0.01 * np.arange(12.0) ** 2))
    fewer = uneven.decimated(3)
    assert fewer.step == pytest.approx(np.diff(fewer.time_s))
    assert uneven.sample_time_s == pytest.approx(float(np.median(np.diff(0.01 * np.arange(12.0) ** 2))))


def test_what_is_missing_in_either_signal_or_not_asked_for_does_not_count() -> None:
    whole = press()
    load, reading = whole.force_n.copy(), whole.sensor.values.copy()
    load[300:304], reading[303:310] = np.nan, np.nan
    gappy = Recording.from_arrays(time_s=whole.time_s + 5.0, force_n=load, pressure_mbar=reading)
    wanted = np.ones(load.size, dtype=bool)
    wanted[:50] = False
    (found,), unit = prepare([gappy], {gappy.name: wanted})
    assert np.flatnonzero(~found.mask).tolist() == [*range(50), *range(300, 310)]
    assert (found.n_missing, unit.symbol, found.time_s[0], found.rows) == (10, "mbar", 0.0, None)
    assert found.load_n[301] == pytest.approx(load[299] + (load[304] - load[299]) * 2.0 / 5.0)
    assert found.command_n is None


# -- of c and the gains ----------------------------------------------------------------------------------------------
def test_a_pole_that_is_none_and_another_shape_are_refused_and_the_rest_is_tested_by_hand() -> None:
    for a1, covariance in ((0.0, np.eye(3)), (-0.1, np.eye(3)), (0.2, np.eye(2))):
        with pytest.raises(UsageError, match="give a1 above 0"):
            consistency_test((a1, 1.6, 0.3), covariance)
    # b0 - b1/a1 - s X c a1 = 2.4 - 1.5 - 2 x 0.5 x 1.2 x 0.2 = 0.66; its slopes are 0.3/0.04 - 1.2, 1 and -5.
    covariance = np.array([[0.01, 0.002, 0.0], [0.002, 0.04, 0.001], [0.0, 0.001, 0.0009]])
    slope = np.array([6.3, 1.0, -5.0])
    found = consistency_test((0.2, 2.4, 0.3), covariance, scale=2.0, c=1.2, x_over_nrt=0.5)
    statistic = 0.66**2 / float(slope @ covariance @ slope)
    assert found.statistic == pytest.approx(statistic)
    assert found.p_value == pytest.approx(float(gammaincc(0.5, statistic / 2.0)))
    assert (found.k2_from_gains, found.k2_from_pole) == (pytest.approx(0.9), pytest.approx(0.24))
    assert found.consistent
    assert found.to_dict() == {
        "statistic": found.statistic, "p_value": found.p_value, "degrees": 1, "k2_from_gains": found.k2_from_gains,
        "k2_from_pole": found.k2_from_pole, "says": found.says,
    }  # fmt: skip
    assert " agree (" in found.says
    sharp = consistency_test((0.2, 2.4, 0.3), 1e-4 * covariance, scale=2.0, c=1.2, x_over_nrt=0.5)
    assert not sharp.consistent
    assert " do not agree (" in sharp.says
    exact = consistency_test((0.25, 1.75, 0.375), np.zeros((3, 3)), x_over_nrt=1.0)
    assert (exact.statistic, exact.p_value) == (0.0, 1.0)
    assert consistency_test((0.25, 1.8, 0.375), np.zeros((3, 3)), x_over_nrt=1.0).p_value == 0.0


@pytest.mark.parametrize(("p_value", "is_consistent"), [(0.0099, False), (0.01, True), (0.02, True)])
def test_a_form_is_rejected_below_one_percent(p_value: float, is_consistent: bool) -> None:
    assert ConsistencyTest(1.0, p_value, 0.2, 0.3).consistent is is_consistent
