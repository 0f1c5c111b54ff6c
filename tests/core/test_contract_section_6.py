"""The contract's Python lines run as they are written, on small simulated data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import smartshoe
from smartshoe.errors import InputError, SmartShoeError, UsageError
from smartshoe.identification import Identification
from smartshoe.models.first_order import simulate
from smartshoe.recording import Recording

A1, B0, B1 = 0.8, 0.5, 0.3  # 1/s, N/mbar, N/(mbar s)


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Three triangles at three rates with rests; the reading is p, the load what the model says of it, plus noise."""
    t = np.arange(0.0, 60.0, 0.02)
    p = 20.0 + np.interp(t, [0, 3, 8, 13, 20, 23, 26, 34, 36, 38, 50, 60], [0, 0, 200, 0, 0, 200, 0, 0, 200, 0, 0, 0])
    rng = np.random.default_rng(1)
    f = simulate(A1, B0, B1, p - 20.0, t) + rng.normal(0.0, 0.2, t.size)
    return smartshoe.Recording.from_arrays(time_s=t, force_n=f, pressure_mbar=p, name="triangles", unit="left_toe")


@pytest.fixture(scope="module")
def found(recording: Recording) -> Identification:
    return smartshoe.identify(
        [recording],
        direction="inverse",
        structure="free",
        offset="estimate",
        delay="estimate",
        initial_state="estimate",
    )


def test_identification_says_what_it_found(recording: Recording, found: Identification) -> None:
    a1 = found.parameters["a1"]
    assert abs(a1.value - A1) < 5 * a1.sd
    assert found.covariance.shape == (len(found.parameters),) * 2
    assert "a1" in found.summary()
    assert "\n" in found.summary()
    assert "\n" not in repr(found)
    assert "<table>" in found._repr_html_()
    fixed = smartshoe.identify([recording], direction="inverse", offset=20.0, delay=0.0, initial_state="steady")
    assert fixed.delay_s.value == 0.0


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("offset", ["estimate", 20.0])
def test_what_the_model_predicts_is_the_measured_signal_but_for_noise(
    recording: Recording, direction: Any, offset: Any
) -> None:
    found = smartshoe.identify([recording], direction=direction, offset=offset)
    measured = recording.force_n if direction == "inverse" else recording["pressure"].values
    error = found.predicted("triangles") - measured
    np.testing.assert_allclose(error, found.errors["triangles"], rtol=0, atol=1e-9)
    assert float(np.sqrt(np.mean(error[50:-50] ** 2))) < 0.01 * float(np.ptp(measured))
    assert np.array_equal(found.predicted(recording), found.predicted("triangles"))


def test_a_prediction_of_another_recording_is_refused(recording: Recording, found: Identification) -> None:
    with pytest.raises(UsageError, match="'walk' is not of this fit: use one of triangles"):
        found.predicted("walk")
    with pytest.raises(UsageError, match="samples"):
        found.predicted(recording.between(0.0, 5.0))
    with pytest.raises(UsageError, match="of type int"):
        found.predicted(3)  # type: ignore[arg-type]


def test_of_recordings_of_one_name_each_has_its_own_prediction(recording: Recording, tmp_path: Path) -> None:
    """Two of one length, as arrays are that were given no name."""
    other = recording.with_channel(recording.load.with_values(recording.force_n[::-1] * 0.5))
    other = other.with_channel(other.sensor.with_values(20.0 + 0.5 * (recording.sensor.values[::-1] - 20.0)))
    found = smartshoe.identify([recording, other], direction="inverse")
    assert [*found.errors] == ["triangles", "triangles (2)"]
    for one, name in ((recording, "triangles"), (other, "triangles (2)")):
        path = tmp_path / f"{name}.csv"
        smartshoe.write(one, path)
        for same in (one, path, str(path), one.to_frame()):
            assert np.array_equal(found.predicted(same), found.predicted(name))
    assert not np.array_equal(found.predicted(recording), found.predicted(other))
    volts = recording.to_frame().rename(columns={"pressure_mbar": "pressure_v"})
    with pytest.raises(UsageError, match="'recording' is not of this fit, in which none has its samples"):
        found.predicted(volts)


def test_compensation_as_an_array_a_signal_and_a_stream(recording: Recording, found: Identification) -> None:
    calibration = found.calibration(unit="left_toe")
    force_n = smartshoe.compensate(recording, calibration)
    assert isinstance(force_n, np.ndarray)
    assert np.sqrt(np.mean((force_n - recording.force_n) ** 2)) < 1.0
    filter_ = found.compensator(sample_rate_hz=100.0)
    pressure = recording["pressure"].values[:300]
    whole = filter_.apply(pressure)
    assert np.array_equal(np.concatenate([[filter_.push(float(pressure[0]))], filter_.push(pressure[1:])]), whole)
    bank = smartshoe.stack([found.compensator() for _ in range(4)])
    assert bank.push(np.full(4, 50.0)).shape == (4,)
    assert bank.push(np.full((7, 4), 50.0)).shape == (7, 4)


def test_validation_and_recording_show_themselves(recording: Recording, found: Identification) -> None:
    validation = smartshoe.validate(recording, found.calibration())
    for shown in (validation, recording, found):
        assert "\n" not in repr(shown)
        assert len(shown.summary().splitlines()) > 2
        assert shown._repr_html_().count("<tr>") == shown._repr_html_().count("</tr>") > 1
        assert all(axis.lines for axis in shown.plot().axes)


def test_names_in_html_are_escaped() -> None:
    recording = Recording.from_arrays(time_s=[0.0, 1.0], force_n=[0.0, 1.0], name="<b>x</b>")
    assert "<b>x" not in recording._repr_html_()


def test_a_refused_diagnosis_shows_its_reason() -> None:
    t = np.arange(0.0, 3.0, 0.01)
    flat = Recording.from_arrays(time_s=t, force_n=np.zeros_like(t), pressure_mbar=np.zeros_like(t))
    diagnosis = smartshoe.diagnose([flat], hold_out=[])
    assert diagnosis.to_dict()["verdict"] == "refused"
    assert diagnosis.summary().startswith("refused: ")
    assert "\n" not in repr(diagnosis)
    with pytest.raises(SmartShoeError, match="no model to plot"):
        diagnosis.plot()


def test_a_path_and_a_frame_are_taken_for_the_recording_they_hold(
    recording: Recording, found: Identification, tmp_path: Path
) -> None:
    path = tmp_path / "triangles.csv"
    smartshoe.write(recording, path)
    assert len(smartshoe.read(str(path))) == len(recording)
    calibration = found.calibration()
    expected = smartshoe.compensate(recording, calibration)
    frame = recording.to_frame()
    for same in (path, str(path), frame, frame.set_index("time_s")):
        assert np.array_equal(smartshoe.compensate(same, calibration), expected)
    assert smartshoe.identify(frame).parameters["a1"].value == pytest.approx(found.parameters["a1"].value)
    assert smartshoe.validate([str(path)], calibration).traces[0].name == "triangles"


def test_a_calibration_is_taken_by_its_path_and_several_from_a_folder(
    recording: Recording, found: Identification, tmp_path: Path
) -> None:
    calibration = found.calibration(unit="left_toe")
    calibration.save(tmp_path / "left_toe.json")
    expected = smartshoe.compensate(recording, calibration)
    assert np.array_equal(smartshoe.compensate(recording, tmp_path / "left_toe.json"), expected)
    assert smartshoe.validate(recording, str(tmp_path / "left_toe.json")).unit == "left_toe"
    for given in (tmp_path, str(tmp_path / "left_toe.json"), [tmp_path], calibration, [calibration]):
        assert [one.a1 for one in smartshoe.load_calibrations(given)] == [calibration.a1]
    store = smartshoe.CalibrationStore(tmp_path / "store")
    store.add(calibration, serial_number="S1", date="2026-03-31", valid_for_days=30.0)
    listed = store.to_dict("2026-06-01")
    assert listed["schema"] == "smartshoe.calibrations/1"
    assert [entry["is_expired"] for unit in listed["units"] for entry in unit["calibrations"]] == [True]
    with pytest.raises(InputError, match="store is a store: take each unit's calibration out of it"):
        smartshoe.load_calibrations(tmp_path / "store")


@pytest.mark.parametrize(
    ("verb", "says"),
    [
        (lambda: smartshoe.load_calibrations(3), "calibrations is of type int: give a Calibration"),
        (lambda: smartshoe.identify([3.0]), r"recordings\[0\] is of type float"),
        (lambda: smartshoe.identify({"a": 1}), "recordings is of type dict"),
        (lambda: smartshoe.validate(None, None), "recordings is of type NoneType"),
        (lambda: smartshoe.compensate(np.zeros(3), None), "recording is of type ndarray"),
        (lambda: smartshoe.diagnose([b"x"]), r"recordings\[0\] is of type bytes"),
        (lambda: smartshoe.gait.analyse([object()]), r"recordings\[0\] is of type object"),
    ],
)
def test_anything_else_is_refused_by_argument_and_type(verb: Callable[[], Any], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        verb()


def test_a_frame_that_is_no_plain_table_is_refused(recording: Recording) -> None:
    frame = recording.to_frame()
    with pytest.raises(SmartShoeError, match="no column time_s"):
        smartshoe.identify(frame.drop(columns="time_s"))
    with pytest.raises(SmartShoeError, match="'force_n' of the DataFrame holds no numbers"):
        smartshoe.identify(frame.assign(force_n="much"))


def test_transfer_functions_are_identified(recording: Recording) -> None:
    u = np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], 120), 20)
    t = 0.05 * np.arange(u.size)
    y = simulate(1.5, 0.0, 3.0, u, t) + np.random.default_rng(4).normal(0.0, 0.01, u.size)
    estimate = smartshoe.identify_transfer_function(
        u, y, sample_time_s=0.05, poles=1, zeros=0, method="srivc", intersample="foh", prefilter_rad_s=2.0, delay_s=0.0
    )
    assert estimate.denominator == pytest.approx([1.0, 1.5], rel=0.02)
    assert estimate.numerator == pytest.approx([3.0], rel=0.02)
    assert estimate.converged
    assert estimate.iterations >= 1
    assert estimate.covariance.shape == (2, 2)


def test_devices_open_by_url_and_a_walk_becomes_a_result() -> None:
    blocks = []
    with smartshoe.open_shoe("sim:walk") as shoe:
        for block in shoe.blocks():
            blocks.append(block)
            if len(blocks) == 2:
                break
    assert len(blocks) == 2
    with smartshoe.open_machine("sim:instron") as machine:
        assert machine is not None


def test_dir_shows_verbs_and_classes_only() -> None:
    assert dir(smartshoe) == sorted(smartshoe.__all__)
    assert all(callable(getattr(smartshoe, name)) for name in dir(smartshoe))
    assert {"compensate", "identify", "Validation", "GaitResult"} <= set(dir(smartshoe))


@pytest.mark.parametrize("rate_hz", [0, -1.0, float("nan"), float("inf"), "100 Hz", None])
def test_a_rate_that_is_none_is_a_wrong_argument(recording: Recording, found: Identification, rate_hz: Any) -> None:
    """Of whichever call, as the command line's exit status 2 has it, and not a fault of any file."""
    diagnosis = smartshoe.diagnose(recording)
    calls: list[Callable[[], object]] = [lambda: found.compensator(sample_rate_hz=rate_hz)]
    if rate_hz is not None:  # where it is left away, the data's own
        calls += [
            lambda: found.discrete(rate_hz),
            lambda: diagnosis.calibration(sample_rate_hz=rate_hz),
            lambda: diagnosis.calibration().compensator(rate_hz),
        ]
    for call in calls:
        with pytest.raises(UsageError, match=r"^sample_rate_hz is .*: give a positive number$"):
            call()


def test_what_is_of_no_use_is_refused_by_its_name(recording: Recording, found: Identification) -> None:
    """Each in one sentence, and none of them by an error of numpy's."""
    filter_ = found.compensator()
    wrong: list[tuple[Callable[[], object], str]] = [
        (lambda: smartshoe.read(recording), "path is of type Recording: give the name of a file"),  # type: ignore[arg-type]
        (lambda: smartshoe.identify(recording, offset=None), "offset is None: give a finite number or 'estimate'"),  # type: ignore[arg-type]
        (lambda: filter_.push("full"), "readings: not all are real numbers"),  # type: ignore[call-overload]
        (lambda: filter_.apply(["1", "x"]), "readings: not all are real numbers"),
        (lambda: filter_.apply([1j]), "readings: not all are real numbers"),
        (lambda: smartshoe.stack([filter_]).push(["x"]), "readings: not all are real numbers"),
        (lambda: smartshoe.stack(filter_), "filters is of type Compensator: give stack"),  # type: ignore[arg-type]
        (lambda: smartshoe.stack([found]), "filters hold one of type Identification"),  # type: ignore[list-item]
        (lambda: smartshoe.open_shoe(None), "a device's address is of type NoneType"),  # type: ignore[arg-type]
        (
            lambda: Recording.from_arrays(time_s=[0.0, 1.0], force_n=["a", "b"]),
            "channel force: not all are real numbers",
        ),
        (
            lambda: Recording.from_arrays(time_s=[0.0, 1.0], force_n=np.array([1j, 0])),
            "channel force: not all are real",
        ),
    ]
    for call, said in wrong:
        with pytest.raises(SmartShoeError, match=said):
            call()
    u, y = np.sin(np.arange(0.0, 50.0, 0.1)), np.cos(np.arange(0.0, 50.0, 0.1))
    for options, said in (
        ({"poles": 1.5}, "poles=1.5 and zeros=0: give whole numbers"),
        ({"poles": "2"}, "poles='2' and zeros=0: give whole numbers"),
        ({"delay_s": 1e9}, r"delay_s is 1e\+09 s and the shortest experiment lasts 49.9 s: give less"),
    ):
        with pytest.raises(UsageError, match=said):
            smartshoe.identify_transfer_function(u, y, sample_time_s=0.1, **{"poles": 1, "zeros": 0, **options})
