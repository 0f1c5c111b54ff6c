"""Every number that a fit shows, by what it must be: of known plants, gaps, names and rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import TOE, coefficients, press

from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.identification import identify
from smartshoe.identification._experiment import block_means, masked, prepare, whole_blocks
from smartshoe.identification._identification import Identification, fit_percent
from smartshoe.identification._noise import output_variance
from smartshoe.identification.leave_out import LeaveOneRateOut, leave_one_rate_out
from smartshoe.identification.recursive import RecursiveIdentification
from smartshoe.recording import Recording

Array = NDArray[np.float64]

LOAD_SD_N = 2.0


@pytest.fixture(scope="module")
def inverse() -> Identification:
    first = press(load_noise=LOAD_SD_N, offset=4.0, name="a", gap=slice(700, 720))
    return identify([first, press(load_noise=LOAD_SD_N, offset=9.0, seed=1, name="b", rates=(200.0, 800.0))])


@pytest.fixture(scope="module")
def forward() -> Identification:
    return identify(press(reading_noise=1.0, offset=4.0, name="a"), direction="forward")


# -- what is left --------------------------------------------------------------------------------------------------
def test_what_is_left_is_measured_minus_model(inverse: Identification, forward: Identification) -> None:
    first = press(load_noise=LOAD_SD_N, offset=4.0, name="a", gap=slice(700, 720))
    left, said = inverse.residuals["a"], inverse.predicted("a")
    lost = np.zeros(len(first), dtype=bool)
    lost[700:720] = True
    inner = slice(20, len(first) - 20)  # a delay reaches beyond the ends
    assert np.isnan(left)[inner].tolist() == lost[inner].tolist()
    lost = np.isnan(left)
    assert left[~lost] == pytest.approx((first.force_n - said)[~lost], abs=1e-9)
    assert np.nanstd(left) == pytest.approx(LOAD_SD_N, rel=0.05)
    reading = press(reading_noise=1.0, offset=4.0, name="a").sensor.values
    seen = np.isfinite(forward.residuals["a"])
    assert seen.mean() > 0.99
    assert forward.residuals["a"][seen] == pytest.approx((reading - forward.predicted("a"))[seen], abs=1e-9)


def test_errors_are_counted_over_all_samples_that_count(inverse: Identification, forward: Identification) -> None:
    left = np.concatenate([one[np.isfinite(one)] for one in inverse.residuals.values()])
    assert inverse.rmse == pytest.approx(float(np.sqrt(np.mean(left**2))), rel=0.01)
    assert inverse.n_samples == left.size
    assert inverse.n_missing == 20
    assert (inverse.rmse_unit, forward.rmse_unit) == ("N", "mbar")
    for name, rates, seed, gap in (
        ("a", (100.0, 400.0, 800.0), 0, slice(700, 720)),
        ("b", (200.0, 800.0), 1, slice(0, 0)),
    ):
        load = press(load_noise=LOAD_SD_N, seed=seed, name=name, rates=rates).force_n
        kept = np.ones(load.size, dtype=bool)
        kept[gap] = False
        own = inverse.residuals[name]
        kept &= np.isfinite(own)
        own = own[kept]
        spread = np.linalg.norm(load[kept] - load[kept].mean())
        assert np.count_nonzero(~kept) < 40
        assert inverse.fit_percent_by_recording[name] == pytest.approx(100.0 * (1.0 - np.linalg.norm(own) / spread))


def test_fit_percent_is_as_matlabs_compare_has_it() -> None:
    y = np.array([0.0, 2.0, 4.0, 2.0])
    assert fit_percent(y, np.zeros(4)) == 100.0
    assert fit_percent(y, y - y.mean()) == pytest.approx(0.0)
    assert fit_percent(y + 50.0, 0.5 * (y - y.mean())) == pytest.approx(50.0)
    assert np.isnan(fit_percent(np.ones(4), np.zeros(4)))


def test_what_was_put_in_lies_within_error_bars(inverse: Identification, forward: Identification) -> None:
    for found in (inverse, forward):
        for name, truth in zip(("a1", "b0", "b1"), coefficients(*TOE), strict=True):
            one = found.parameters[name]
            assert one.value == pytest.approx(truth, abs=4.0 * one.sd)
            assert one.sd < 0.1 * one.value
            assert one.ci95 == pytest.approx((one.value - 1.96 * one.sd, one.value + 1.96 * one.sd), rel=1e-3)
        assert (found.solid.k1, found.solid.k2, found.solid.c) == tuple(
            found.parameters[name].value for name in ("k1", "k2", "c")
        )
    for name, zero in (("a", 4.0), ("b", 9.0)):
        assert inverse.offsets[name].value == pytest.approx(zero, abs=4.0 * inverse.offsets[name].sd)
    assert inverse.offset == pytest.approx(6.5, abs=0.5)
    assert inverse.noise["load"].value == pytest.approx(LOAD_SD_N, rel=0.05)
    assert forward.noise["reading"].value == pytest.approx(1.0, rel=0.05)


def test_what_is_known_has_no_error_bar(inverse: Identification) -> None:
    """A noise is told by its size alone; a spring that was given stays where it is."""
    assert {name: (one.sd, one.unit) for name, one in inverse.noise.items()} == {
        "load": (0.0, "N"), "reading": (0.0, "mbar")
    }  # fmt: skip
    held = identify(press(load_noise=LOAD_SD_N), structure="grey_box", fixed={"k1": TOE[0]})
    one = held.parameters["k1"]
    assert (one.value, one.sd, one.ci95) == (pytest.approx(TOE[0]), 0.0, (one.value, one.value))
    # Of data that hardly tell the pole as well, where intervals are those of the likelihood.
    loud = identify(press(load_noise=80.0), structure="grey_box", fixed={"k1": TOE[0], "c": 1.0}, delay=0.0)
    assert any("likelihood profile" in note for note in loud.remarks)
    for name in ("k1", "c"):
        one = loud.parameters[name]
        assert one.ci95 == (one.value, one.value)


def test_correlations_are_those_of_the_covariance(inverse: Identification) -> None:
    sds = np.array([one.sd for one in inverse.parameters.values()])
    assert np.sqrt(np.diag(inverse.covariance)) == pytest.approx(sds)
    assert inverse.correlation * np.outer(sds, sds) == pytest.approx(inverse.covariance, rel=1e-9)
    assert np.diag(inverse.correlation) == pytest.approx(np.ones(6))
    assert np.all(np.abs(inverse.correlation) <= 1.0)
    # Without a second estimate three of six follow from the other three.
    assert np.linalg.matrix_rank(inverse.correlation, tol=1e-6) == 3


def test_ranges_are_those_of_the_recordings(inverse: Identification) -> None:
    assert inverse.load_range_n == pytest.approx((0.0, 800.0), abs=5.0 * LOAD_SD_N)
    slowest, fastest = identify(press(load_noise=0.05)).rate_range_n_per_s
    assert (slowest, fastest) == pytest.approx((100.0, 800.0), rel=0.03)
    assert inverse.sample_rate_hz == pytest.approx(100.0)


def test_filter_and_calibration_hold_the_coefficients(inverse: Identification) -> None:
    a1, b0, b1 = inverse.coefficients
    numerator, denominator = inverse.discrete()
    # A bilinear filter of 100 Hz: at no frequency b1/a1, at half the rate b0.
    assert numerator.sum() / denominator.sum() == pytest.approx(b1 / a1)
    assert (numerator[0] - numerator[1]) / (denominator[0] - denominator[1]) == pytest.approx(b0)
    assert inverse.discrete(50.0)[1][1] != pytest.approx(denominator[1])
    made = inverse.calibration("2026-01-02", unit="heel")
    assert (made.a1, made.b0, made.b1, made.offset) == (a1, b0, b1, inverse.offset)
    assert (made.unit, made.created, inverse.calibration().unit) == ("heel", "2026-01-02", "left_toe")
    assert made.load_range_n == inverse.load_range_n
    assert made.delay_s == inverse.delay_s.value
    held = np.full(4000, 20.0 + inverse.offset)
    assert inverse.compensator().apply(held)[-1] == pytest.approx(20.0 * b1 / a1, rel=1e-3)


def test_json_holds_what_the_object_says(inverse: Identification) -> None:
    told = inverse.to_dict()
    assert told["schema"] == "smartshoe.identification/1"
    for name, one in inverse.parameters.items():
        assert told["parameters"][name]["value"] == one.value
    assert told["correlation"]["names"] == list(inverse.parameters)
    assert told["correlation"]["matrix"][0][1] == pytest.approx(inverse.correlation[0, 1])
    assert told["rmse"] == {"value": inverse.rmse, "unit": "N"}
    assert told["discrete"]["sample_rate_hz"] == inverse.sample_rate_hz
    assert (told["n_samples"], told["n_missing"]) == (inverse.n_samples, inverse.n_missing)
    assert told["consistency"] is not None
    assert told["notes"] == list(inverse.notes)


def test_a_figure_shows_the_load_or_the_reading(inverse: Identification, forward: Identification) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib import pyplot

    for found, quantity, unit in ((inverse, "load", "N"), (forward, "reading", "mbar")):
        figure = found.plot()
        upper, lower = figure.axes[:2]
        assert (upper.get_ylabel(), lower.get_ylabel()) == (f"{quantity} ({unit})", f"residual ({unit})")
        assert [line.get_label() for line in upper.lines] == ["measured", "model"]
        assert [text.get_text() for text in upper.get_legend().get_texts()] == ["measured", "model"]
        assert (upper.get_title(), lower.get_xlabel()) == ("a", "time (s)")
        measured, model = (np.asarray(line.get_ydata(), dtype=float) for line in upper.lines)
        left = np.asarray(lower.lines[0].get_ydata(), dtype=float)
        seen = np.isfinite(left)
        assert left[seen] == pytest.approx((measured - model)[seen], abs=1e-9)
        pyplot.close(figure)
    assert len(inverse.plot().axes) == 4
    pyplot.close("all")


def test_a_summary_names_every_number(inverse: Identification) -> None:
    text = str(inverse.summary()) if hasattr(inverse, "summary") else repr(inverse)
    assert "left_toe" in text


# -- recordings made ready ---------------------------------------------------------------------------------------
def test_means_of_neighbours_and_whole_blocks_leave_the_rest_out() -> None:
    assert block_means(np.arange(7.0), 3) == pytest.approx([1.0, 4.0])
    mask = np.ones(7, dtype=bool)
    mask[4] = mask[6] = False
    assert whole_blocks(mask, 3).tolist() == [True, False]
    assert masked(np.arange(7.0), mask).tolist() == [0.0, 1.0, 2.0, 3.0, 5.0]
    together = np.array([False, True, True, True, False, False, False])
    assert masked(np.arange(7.0), together).tolist() == [1.0, 2.0, 3.0]


def test_a_start_is_looked_for_in_means() -> None:
    (whole,), _ = prepare([press(gap=slice(700, 705))])
    fewer = whole.decimated(10)
    assert fewer.time_s.size == whole.time_s.size // 10
    assert fewer.step == pytest.approx(0.1)
    assert fewer.load_n == pytest.approx(block_means(whole.load_n, 10))
    assert fewer.reading == pytest.approx(block_means(whole.reading, 10))
    assert np.flatnonzero(~fewer.mask).tolist() == [70]
    assert whole.decimated(1) is whole
    assert whole.decimated(whole.time_s.size) is whole
    assert (whole.time_s[0], whole.n_missing) == (0.0, 5)
    assert np.isfinite(whole.reading).all()


def test_recordings_of_one_name_are_told_apart() -> None:
    experiments, unit = prepare([press(), press(seed=1), press(seed=2)])
    assert [one.name for one in experiments] == ["triangles", "triangles (2)", "triangles (3)"]
    assert unit.symbol == "mbar"
    with pytest.raises(UsageError, match="no recording"):
        prepare([])
    with pytest.raises(UsageError, match="no recording here"):
        prepare([press()], {"other": np.ones(5, dtype=bool)})
    with pytest.raises(UsageError, match="one flag a sample"):
        prepare([press()], {"triangles": np.ones(5, dtype=bool)})


def _without_rows(recording: Recording, lost: NDArray[np.bool_]) -> Recording:
    return Recording.from_arrays(
        time_s=recording.time_s[~lost],
        force_n=recording.force_n[~lost],
        pressure_mbar=recording.sensor.values[~lost],
        command_n=recording.force_n[~lost],
    )


def test_rows_that_a_logger_skipped_are_put_back_and_do_not_count() -> None:
    whole = press(load_noise=1.0)
    lost = np.zeros(len(whole), dtype=bool)
    lost[[300, 301, 302, 900]] = True
    (found,), _ = prepare([_without_rows(whole, lost)])
    assert found.step == pytest.approx(0.01)
    assert np.flatnonzero(~found.mask).tolist() == [300, 301, 302, 900]
    assert found.load_n[~lost] == pytest.approx(whole.force_n[~lost])
    assert found.load_n[301] == pytest.approx(0.5 * (whole.force_n[299] + whole.force_n[303]))
    assert found.command_n is not None
    assert found.command_n.size == found.load_n.size
    assert found.of_recording(found.load_n) == pytest.approx(whole.force_n[~lost])
    (uneven,), _ = prepare([_without_rows(whole, lost)], on_one_step=False)
    assert not isinstance(uneven.step, float)
    assert uneven.sample_time_s == pytest.approx(0.01)
    # Jittered stamps are no skipped rows.
    jittered = replace(whole, time_s=whole.time_s + 0.001 * np.sin(np.arange(len(whole))))
    (own,), _ = prepare([jittered])
    assert not isinstance(own.step, float)


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        (np.full(500, 30.0), "load is constant"),
        (np.linspace(0.0, 800.0, 500), "never falls again"),
        (np.linspace(800.0, 0.0, 500), "never rises"),
    ],
)
def test_what_lacks_is_named(loads: Array, words: str) -> None:
    reading = 0.1 * loads + 1e-3 * np.sin(np.arange(500))
    recording = Recording.from_arrays(time_s=0.01 * np.arange(500), force_n=loads, pressure_mbar=reading)
    with pytest.raises(NotIdentifiableError, match=words):
        prepare([recording])
    few = press()
    flags = np.zeros(len(few), dtype=bool)
    flags[250:265] = True
    with pytest.raises(NotIdentifiableError, match="holds 15 samples"):
        prepare([few], {"triangles": flags})
    still = Recording.from_arrays(time_s=few.time_s, force_n=few.force_n, pressure_mbar=np.full(len(few), 7.0))
    with pytest.raises(NotIdentifiableError, match="reading is constant"):
        prepare([few, still][1:])


# -- noise, rates, streams ----------------------------------------------------------------------------------------
def test_the_outputs_noise_is_what_the_inputs_does_not_account_for(inverse: Identification) -> None:
    problem, theta = inverse.fit.problem, inverse.fit.theta
    one = output_variance(problem, theta, 100.0, 0.0)
    assert one == 100.0
    reading_sd = 1.5
    # White noise of a reading passes the compensator with its direct gain and little else.
    passed = (reading_sd * inverse.parameters["b0"].value) ** 2
    assert output_variance(problem, theta, 100.0, reading_sd) == pytest.approx(100.0 - passed, rel=0.02)
    assert output_variance(problem, theta, 100.0, 1e3) == pytest.approx(0.1)


@pytest.fixture(scope="module")
def left_out() -> LeaveOneRateOut:
    return leave_one_rate_out(press(load_noise=1.0, rates=(100.0, 800.0)))


def test_two_rates_are_enough_to_leave_one_out(left_out: LeaveOneRateOut) -> None:
    assert [fold.rate_n_per_s for fold in left_out.folds] == pytest.approx([100.0, 800.0], rel=0.03)
    for name, moved in left_out.movements.items():
        values = [fold.found.parameters[name] for fold in left_out.folds if fold.found is not None]
        assert (moved.lowest, moved.highest) == (min(v.value for v in values), max(v.value for v in values))
        assert moved.value == left_out.everything.parameters[name].value
        assert moved.moved_sd == pytest.approx(max(abs(v.value - moved.value) / v.sd for v in values))


def test_a_stream_says_what_a_fit_of_the_whole_says() -> None:
    recording = press(load_noise=LOAD_SD_N, offset=4.0)
    stream = RecursiveIdentification(sample_rate_hz=100.0, unit="left_toe")
    load = recording.force_n.copy()
    reading = recording.sensor.values.copy()
    load[900], reading[950:960] = np.nan, np.nan
    for part in np.array_split(np.arange(load.size), 7):
        stream.push(load[part], reading[part])
    lost = np.zeros(load.size, dtype=bool)
    lost[900], lost[950:960] = True, True
    found = stream.estimate()
    whole = identify(recording, counted={"triangles": ~lost}, delay=0.0)
    assert (found.n_samples, found.n_missing) == (load.size - 11, 11)
    for name, one in whole.parameters.items():
        assert found.parameters[name].value == pytest.approx(one.value, rel=1e-3)
        assert found.parameters[name].sd == pytest.approx(one.sd, rel=1e-2)
        assert found.parameters[name].unit == one.unit
    (zero,) = found.offsets.values()
    (known,) = whole.offsets.values()
    assert (zero.value, zero.sd) == (pytest.approx(known.value, abs=0.01), pytest.approx(known.sd, rel=0.02))
    assert found.fit_percent == pytest.approx(whole.fit_percent, abs=0.01)
    assert found.rmse == pytest.approx(whole.rmse, rel=1e-2)
    assert found.covariance == pytest.approx(whole.covariance, rel=0.02)
    assert stream.compensator().apply(np.full(3000, 24.0))[-1] == pytest.approx(
        whole.compensator().apply(np.full(3000, 24.0))[-1], rel=1e-3
    )
