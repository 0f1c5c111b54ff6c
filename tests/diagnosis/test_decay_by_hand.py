"""A falling reading, part by part: by formulas, by a slow twin, and at the very bounds that decide."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import curve_fit
from scipy.stats import norm

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis.decay import (
    Decay,
    _course_says,
    _duration,
    _exponential,
    _falls,
    _fit,
    _guess,
    _load_stands_still,
    _of_order,
    _thinned,
    _to_plateau,
    decay_of,
)
from smartshoe.recording import Recording
from smartshoe.signals.noise import white_noise_sd

Array = NDArray[np.float64]

STANDARD = Thresholds()


def _decay(reading: Array, step_s: float = 0.1, thresholds: Thresholds = STANDARD, begun_s: float = 0.0) -> Decay:
    time_s = begun_s + step_s * np.arange(reading.size)
    found = decay_of(Recording.from_arrays(time_s=time_s, pressure_mbar=reading), thresholds)
    assert found is not None
    return found


# -- courses ----------------------------------------------------------------------------------------------------------
def test_courses_are_their_formulas() -> None:
    t = np.array([0.0, 1.0, 5.0, 20.0])
    assert _exponential(np.array([3.0, 4.0]), t) == pytest.approx(3.0 * np.exp(-t / 4.0))
    assert _to_plateau(np.array([3.0, 4.0, 7.0]), t) == pytest.approx(7.0 + 3.0 * np.exp(-t / 4.0))
    for order in (0.5, 1.5, 2.0):
        left = np.maximum(1.0 + (order - 1.0) * t / 30.0, 1e-12)
        assert _of_order(np.array([3.0, 30.0, order]), t) == pytest.approx(3.0 * left ** (1.0 / (1.0 - order)))
    # An orifice is empty after so long, and stays it; an order of one is an exponential.
    assert _of_order(np.array([3.0, 5.0, 0.5]), t)[-1] == pytest.approx(3e-24)
    for order in (1.0, 1.0 + 9e-7, 1.0 - 9e-7):
        assert list(_of_order(np.array([3.0, 4.0, order]), t)) == list(_exponential(np.array([3.0, 4.0]), t))
    # A time constant that a search has taken below nothing is a billionth of a second.
    assert _exponential(np.array([3.0, -1.0]), np.array([0.0, 1e-9])) == pytest.approx([3.0, 3.0 / math.e])
    below = _of_order(np.array([3.0, -1.0, 2.0]), np.array([0.0, 1e-9]))
    assert below == pytest.approx([3.0, 1.5])


# -- the fit ----------------------------------------------------------------------------------------------------------
def _line(at: Array, t: Array) -> Array:
    return np.asarray(at[0] + at[1] * t)


def _lines_sds(t: Array, v: Array) -> tuple[Array, Array, float]:
    design = np.column_stack([np.ones(t.size), t])
    found = np.linalg.lstsq(design, v, rcond=None)[0]
    left = design @ found - v
    square = float(left @ left)
    alike = min(max(float(np.sum(left[1:] * left[:-1])) / square, 0.0), 0.99)
    variance = square / (t.size - 2) * (1.0 + alike) / (1.0 - alike)
    return found, np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design))), square


@pytest.mark.parametrize("off", ["white", "slow", "alternating", "very slow"])
def test_a_fits_deviations_are_those_of_a_line_with_noise_that_goes_on(off: str) -> None:
    t = np.arange(300.0) / 10.0
    rng = np.random.default_rng(4)
    noise = {
        "white": rng.standard_normal(300),
        "slow": np.convolve(rng.standard_normal(304), np.ones(5), "valid"),
        "alternating": np.resize([1.0, -1.0], 300) + 0.1 * rng.standard_normal(300),
        "very slow": 5.0 * np.sin(2.0 * np.pi * t / 30.0),
    }[off]
    v = 4.0 - 0.3 * t + noise
    found, (at, sd, square) = _fit(_line, t, v, [1.0, 0.0]), _lines_sds(t, v)
    assert found.at == pytest.approx(at, rel=1e-4)
    assert found.sd == pytest.approx(sd, rel=1e-4)
    assert found.square == pytest.approx(square, rel=1e-6)


def test_of_as_many_samples_as_numbers_one_is_counted_and_what_has_no_part_has_no_deviation() -> None:
    t, v = np.array([0.0, 1.0]), np.array([1.0, 3.0])
    assert _fit(_line, t, v, [0.9, 2.1]).sd == pytest.approx([0.0, 0.0], abs=1e-6)

    def level(at: Array, t: Array) -> Array:
        return np.asarray(at[0] + 0.0 * t)

    found = _fit(level, t, v, [2.0, 5.0])
    # Two samples a deviation of 1 either side of 2, of one degree: alternating, so that nothing goes on.
    assert (found.at[0], found.square) == (pytest.approx(2.0), pytest.approx(2.0))
    assert found.sd == pytest.approx([1.0, 0.0])
    assert _fit(level, t, np.array([2.0, 2.0]), [2.0, 5.0]).square == 0.0


def test_a_guess_is_the_line_through_the_logarithm_above_a_fifth() -> None:
    t = 0.5 * np.arange(60.0)
    bent = np.where(t < 8.0, np.exp(-t / 5.0), np.exp(-8.0 / 5.0) * np.exp(-(t - 8.0) / 50.0))
    assert _guess(t, 7.0 * bent, 7.0) == pytest.approx(
        5.0
    )  # exp(-1.6) is a fifth and a little: the rest counts too little
    above = bent > 0.2
    slope = np.polyfit(t[above], np.log(bent[above]), 1)[0]
    assert _guess(t, bent, 1.0) == pytest.approx(-1.0 / slope)
    # The first three count in any case, no lower than a billionth of the first.
    drops = np.array([1.0, 0.1, 0.05, 0.01, 0.01])
    assert _guess(t[:5], drops, 1.0) == pytest.approx(-1.0 / np.polyfit(t[:3], np.log(drops[:3]), 1)[0])
    under = np.array([2.0, -1.0, -1.0, -1.0])
    floor = np.log(np.array([2.0, 2e-9, 2e-9]))
    assert _guess(t[:4], under, 2.0) == pytest.approx(-1.0 / np.polyfit(t[:3], floor, 1)[0])
    # What rises falls in a thousand times the record, and nothing falls in less than a thousandth or in for ever.
    assert _guess(t, np.exp(t / 5.0), 1.0) == pytest.approx(1e3 * t[-1])
    assert _guess(t, 1.0 - 1e-9 * t, 1.0) == pytest.approx(1e6 * t[-1])
    assert _guess(np.array([0.0, 1e-4, 2e-4, 3.0]), np.array([1.0, 0.9, 0.8, 0.1]), 1.0) == pytest.approx(3e-3)


# -- what is looked at ------------------------------------------------------------------------------------------------
def test_a_long_record_is_taken_in_means_of_blocks() -> None:
    time_s, values = np.arange(23.0), 100.0 - np.arange(23.0)
    t, v, sign = _thinned(time_s, values, 5)
    assert list(t) == [2.0, 7.0, 12.0, 17.0]  # five in a block, the rest left out
    assert list(v) == [98.0, 93.0, 88.0, 83.0]
    assert sign == 1.0
    assert list(_thinned(time_s, values, 23)[1]) == list(values)
    assert list(_thinned(time_s, values, 22)[0]) == [2.0 * k + 0.5 for k in range(11)]
    assert _thinned(time_s[:0], values[:0], 5)[0].size == 0


def test_a_reading_that_begins_below_nothing_is_turned() -> None:
    values = np.concatenate([np.full(2, -1.0), np.full(38, 0.5)])  # a twentieth of forty
    assert _thinned(np.arange(40.0), values, 100)[1] == pytest.approx(-values)
    values[1] = 1.5
    assert _thinned(np.arange(40.0), values, 100)[1] == pytest.approx(values)
    short = np.array([-1.0, 2.0, 2.0])
    assert _thinned(np.arange(3.0), short, 100)[1] == pytest.approx(-short)
    assert _thinned(np.arange(3.0), 0.0 * short, 100)[1] == pytest.approx(0.0 * short)


def _blocks(*levels: float) -> Array:
    """Twelve levels, ten samples each."""
    return np.repeat(np.array(levels, dtype=float), 10)


def test_a_fall_is_more_than_what_counts() -> None:
    for by, falls in ((0.99, False), (1.01, True)):
        low = 5.0 * (1.0 - by * STANDARD.material)
        assert _falls(_blocks(5, 5, 5, 5, 5, 5, low, low, low, low, low, low), STANDARD) is falls


def test_a_fall_is_more_than_the_noise_of_a_tenths_mean() -> None:
    swing = np.resize([1.0, -1.0], 120)
    reading = _blocks(*[9.0] * 6, *[8.0] * 6)
    bound = norm.isf(0.5 * STANDARD.false_alarm / 120.0) * white_noise_sd(swing) / math.sqrt(12.0)
    for by, falls in ((0.999, True), (1.001, False)):
        assert _falls(reading + by / bound * swing, STANDARD) is falls


def test_a_fall_hardly_ever_rises_and_begins_above_nothing() -> None:
    assert _falls(_blocks(9, 9, 9, 6, 6, 6, 7, 7, 7, 7, 7, 7), STANDARD)  # three down, one up: three quarters
    assert not _falls(_blocks(9, 9, 9, 6, 6, 6, 7.01, 7.01, 7.01, 7.01, 7.01, 7.01), STANDARD)
    assert not _falls(_blocks(*[0.0] * 6, *[-3.0] * 6), STANDARD)
    assert _falls(_blocks(*[0.1] * 6, *[-3.0] * 6), STANDARD)
    assert not _falls(_blocks(*[1.0] * 6, *[3.0] * 6), STANDARD)
    assert not _falls(_blocks(*[1.0] * 12), STANDARD)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_load_stands_still_within_that_share_of_its_size(sign: float) -> None:
    def told(low: float, high: float) -> object:
        load = sign * np.repeat([low, high], 100)
        one = Recording.from_arrays(time_s=0.1 * np.arange(200), force_n=load, pressure_mbar=load)
        return _load_stands_still(one, STANDARD.standing)

    assert told(49.0, 50.0) == "still"
    assert told(48.99, 50.0) is None
    torn = np.full(200, 50.0)
    torn[20:60] = np.nan
    torn[100] = 80.0
    one = Recording.from_arrays(time_s=0.1 * np.arange(200), force_n=torn, pressure_mbar=np.ones(200))
    assert _load_stands_still(one, STANDARD.standing) == "still"
    bare = Recording.from_arrays(time_s=0.1 * np.arange(200), pressure_mbar=np.ones(200))
    assert _load_stands_still(bare, STANDARD.standing) == "absent"


# -- what is found ----------------------------------------------------------------------------------------------------
T = 0.1 * np.arange(500)  # as many as are looked at


def _slow_found(reading: Array, model: str) -> tuple[float, float, float]:
    """Onset, time constant and plateau or order, by SciPy's own curve fit from the sample before the fall on."""
    high, low = float(np.median(reading[:3])), float(np.median(reading[-25:]))
    noise = norm.isf(0.5 * STANDARD.false_alarm / reading.size) * white_noise_sd(reading)
    first = max(int(np.argmax(reading < high - max(0.02 * (high - low), noise))) - 1, 0)
    t, v = T[first:] - T[first], reading[first:]

    def course(t: Array, level: float, tau_s: float, other: float = 0.0) -> Array:
        if model == "order":
            return np.asarray(level * np.maximum(1.0 + (other - 1.0) * t / tau_s, 1e-12) ** (1.0 / (1.0 - other)))
        return np.asarray(level * np.exp(-t / tau_s) + other)

    start = {"order": [high, 10.0, 1.3], "plateau": [high - low, 10.0, low], "exponential": [high, 10.0]}[model]
    at = curve_fit(course, t, v, start)[0]
    return float(T[first]), float(at[1]), float(at[2]) if len(at) > 2 else 0.0


@pytest.mark.parametrize("noise", [1e-3, 0.3])
@pytest.mark.parametrize(("waits_s", "tau_s"), [(0.0, 20.0), (7.0, 12.0), (0.0, 12.0)])
def test_a_plateau_and_a_time_constant_are_those_of_a_fit_from_the_onset_on(
    waits_s: float, tau_s: float, noise: float
) -> None:
    later = np.maximum(T - waits_s, 0.0)
    reading = 60.0 + 40.0 * np.exp(-later / tau_s) + noise * np.random.default_rng(3).standard_normal(T.size)
    found = _decay(reading, begun_s=9.0)
    onset_s, tau_s, plateau = _slow_found(reading, "plateau")
    assert (found.onset_s, found.tau_s, found.plateau) == pytest.approx((onset_s, tau_s, plateau), rel=1e-4)
    high, low = float(np.median(reading[:3])), float(np.median(reading[-25:]))
    assert found.lost_percent == pytest.approx(100.0 * (high - low) / high)
    assert found.within_s == pytest.approx(T[-1] - onset_s)
    # Counted from the first sample on by an exponential to nothing, where it did not begin there.
    whole = curve_fit(lambda t, level, tau: level * np.exp(-t / tau), T, reading, [high, 100.0])[0][1]
    assert found.from_start_s == pytest.approx(whole if onset_s else tau_s, rel=1e-3)


@pytest.mark.parametrize("order", [0.6, 1.5])
def test_an_order_is_that_of_a_fit_and_its_interval_of_two_standard_deviations(order: float) -> None:
    left = np.maximum(1.0 + (order - 1.0) * T / 15.0, 1e-12)
    reading = 90.0 * left ** (1.0 / (1.0 - order)) + 0.05 * np.random.default_rng(6).standard_normal(T.size)
    found = _decay(reading)
    onset_s, _, fitted = _slow_found(reading, "order")
    assert found.order == pytest.approx(fitted, abs=1e-4)
    assert found.order_ci95 is not None
    assert np.mean(found.order_ci95) == pytest.approx(found.order)
    first = round(onset_s / 0.1)
    ordered = _fit(_of_order, T[first:] - T[first], reading[first:], [90.0, 15.0, order])
    assert found.order_ci95[1] - fitted == pytest.approx(1.959964 * float(ordered.sd[2]), rel=1e-2)
    _, tau_s, _ = _slow_found(reading, "exponential")
    one = _fit(_exponential, T[first:] - T[first], reading[first:], [90.0, 15.0])
    assert found.tau_s == pytest.approx(tau_s, rel=1e-4)
    half = 1.959964 * float(one.sd[1])
    assert found.ci95_s == pytest.approx((max(found.tau_s - half, 0.0), found.tau_s + half), rel=1e-4)


@pytest.mark.parametrize(("order", "course"), [(1.03, "exponential"), (0.97, "exponential"), (1.05, "slower"),
                                               (0.95, "faster")])  # fmt: skip
def test_an_order_that_is_hardly_another_one_is_an_exponential(order: float, course: str) -> None:
    reading = 90.0 * np.maximum(1.0 + (order - 1.0) * T / 15.0, 1e-12) ** (1.0 / (1.0 - order))
    assert _decay(reading).course == course


@pytest.mark.parametrize(("lost", "course"), [(0.0395, "undecided"), (0.0405, "exponential")])
def test_a_law_is_told_of_more_than_what_is_clear_of_standing_still(lost: float, course: str) -> None:
    reading = 90.0 * np.exp(T / (T[-13] - T[1]) * math.log(1.0 - lost))  # between the medians of both ends
    found = _decay(reading)
    assert found.lost_percent == pytest.approx(100.0 * lost, rel=2e-3)
    assert found.course == course
    assert course == "exponential" or found.onset_s == 0.0


@pytest.mark.parametrize(("plateau", "is_told"), [(0.035, False), (0.045, True)])
def test_a_plateau_is_clear_of_nothing(plateau: float, is_told: bool) -> None:
    found = _decay(100.0 * (plateau + (1.0 - plateau) * np.exp(-T / 8.0)))
    assert found.plateau == (pytest.approx(100.0 * plateau, rel=1e-3) if is_told else 0.0)


def test_a_plateau_that_a_power_explains_as_well_is_none() -> None:
    reading = 90.0 * (1.0 + 0.7 * T / 8.0) ** (-1.0 / 0.7)
    assert _decay(reading).plateau == 0.0
    # And one that hardly betters an exponential, under noise, is none: it must leave half.
    noise = 2.0 * np.random.default_rng(5).standard_normal(T.size)
    assert _decay(5.0 + 85.0 * np.exp(-T / 12.0) + noise).plateau == 0.0


@pytest.mark.parametrize(("same", "is_told"), [(1.01, True), (0.99, False)])
def test_an_order_that_is_known_too_little_is_not_told(same: float, is_told: bool) -> None:
    reading = 90.0 * np.exp(-T / 200.0) + 0.1 * np.random.default_rng(3).standard_normal(T.size)
    found = _decay(reading, thresholds=replace(STANDARD, same=0.45))
    assert found.order is not None
    assert found.order_ci95 is not None
    half = 0.5 * (found.order_ci95[1] - found.order_ci95[0])
    told = _decay(reading, thresholds=replace(STANDARD, same=same * half))
    assert (told.order is not None) is is_told
    assert (told.course == "undecided") is not is_told


def test_an_onset_is_said_once_it_is_later_than_what_stands_still() -> None:
    for waits_s, is_said in ((0.8, False), (1.3, True)):  # two hundredths of fifty seconds
        found = _decay(100.0 * np.exp(-np.maximum(T - waits_s, 0.0) / 5.0))
        assert found.onset_s == pytest.approx(waits_s, abs=0.11)
        assert (" s on" in found.says) is is_said
    for lost, is_counted in ((0.47, False), (0.53, True)):
        later = np.maximum(T - 5.0, 0.0)
        said = _decay(100.0 * (1.0 - lost * (1.0 - np.exp(-later / 3.0)))).says
        assert ("when counted from the first sample" in said) is is_counted


@pytest.mark.parametrize(("begins", "is_told"), [(104, True), (105, False)])
def test_a_fall_of_which_less_than_a_quarter_of_a_local_scale_is_seen_is_none(begins: int, is_told: bool) -> None:
    reading = 100.0 * np.exp(-0.2 * np.maximum(np.arange(120.0) - begins, 0.0))
    found = decay_of(Recording.from_arrays(time_s=T[:120], pressure_mbar=reading))
    assert (found is not None) is is_told
    assert found is None or found.onset_s == pytest.approx(T[begins])


def test_fewer_samples_than_tell_anything_are_no_decay() -> None:
    for count, is_told in ((99, False), (100, True)):
        reading = 100.0 * np.exp(-np.arange(count) / 30.0)
        torn = np.concatenate([reading, np.full(30, np.nan)])
        one = Recording.from_arrays(time_s=0.1 * np.arange(torn.size), pressure_mbar=torn)
        assert (decay_of(one, STANDARD) is not None) is is_told


# -- words ------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("time_s", "words"),
    [(599.0, "599 s"), (600.0, "10 min"), (7199.0, "120 min"), (7200.0, "2 h"), (12_600.0, "3.5 h")],
)
def test_durations_are_told_in_the_unit_that_suits(time_s: float, words: str) -> None:
    assert _duration(time_s) == words


def test_a_course_is_told_with_its_order() -> None:
    assert _course_says("exponential", 1.0) == "as one exponential"
    assert "power 1.50" in _course_says("slower", 1.5)
    assert _course_says("slower", 1.5).startswith("slower than")
    for course, order in (("undecided", 1.0), ("slower", None), ("undecided", None)):
        assert "too little of the fall is seen" in _course_says(course, order)  # type: ignore[arg-type]
