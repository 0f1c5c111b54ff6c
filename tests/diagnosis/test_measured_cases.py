"""What a diagnosis says of real measurements, and what it must not say: the claims of docs/measured_cases.md."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from smartshoe.diagnosis import Diagnosis, Thresholds, diagnose
from smartshoe.diagnosis.decay import Decay, decay_of
from smartshoe.files.logs import read
from smartshoe.recording import Recording

Array = NDArray[np.float64]

pytestmark = pytest.mark.real_data

HALF_WIDTHS_N = {1: 5.6, 3: 7.6, 5: 9.0, 7: 11.0}  # by bar, from the notes beside the data
INSOLE_ROWS_HZ = 49.0
SATURATED_TAXEL = 251
INSOLE_LAGS_S = {  # from static fits in windows over a grid of lags, apart from this project's code
    "calibration_dataset": 1.4,
    "validation_dataset_3": 1.1,
}


def _friction(measured: Path, name: str, load: str, sensor: str) -> Recording:
    file = measured / "pneumatic_actuator_friction_leak" / "friction" / f"{name}.csv"
    return read(file, time="1[ms]", force=load, sensors=[sensor])


def _leaking(measured: Path, name: str) -> Recording:
    return read(
        measured / "pneumatic_actuator_friction_leak" / "leak" / f"{name}.csv", time="1[ms]", sensors=["3[bar]"]
    )


def _insole(measured: Path, name: str, rows_hz: float, taxel: str = "mean_active_taxels_counts") -> Recording:
    folder = measured / "insole_plenum"
    taxels = np.genfromtxt(folder / f"{name}_C.csv", delimiter=",", names=True)
    reference = np.genfromtxt(folder / f"{name}_P.csv", delimiter=",", names=True)["P_bar"]
    return insole_of(taxels["t_s"], taxels[taxel], reference, rows_hz)


def insole_of(time_s: Array, counts: Array, reference_bar: Array, rows_hz: float) -> Recording:
    """Reference pressure as the force on 1 cm2, its rows at ``rows_hz`` from the taxels' first sample on."""
    since_s = time_s - time_s[0]
    rows_s = np.arange(reference_bar.size) / rows_hz
    kept = (np.diff(since_s, prepend=-1.0) > 0) & (since_s <= rows_s[-1])
    return Recording.from_arrays(
        time_s=since_s[kept],
        force_n=10.0 * np.interp(since_s[kept], rows_s, reference_bar),
        pressure_counts=counts[kept],
    )


def _limit(found: Diagnosis, words: str) -> str:
    said = [sentence for sentence in found.limits if words in sentence]
    assert said, f"no limit with {words!r} in {found.limits}"
    return said[0]


@pytest.fixture(scope="module")
def one_pressure(measured: Path) -> Diagnosis:
    return diagnose(_friction(measured, "Circle_1bar", "7[N]", "6[bar]"))


class TestFriction:
    def test_a_single_rate_tells_viscous_friction_from_coulombs_by_nothing(self, one_pressure: Diagnosis) -> None:
        assert "Coulomb" in _limit(one_pressure, "one loading rate only")

    def test_the_gain_within_a_file_is_called_a_trap_and_nothing_is_named(self, one_pressure: Diagnosis) -> None:
        assert not one_pressure.causes
        within, through_zero = map(float, re.findall(r"\(([\d.]+) N/bar\)", _limit(one_pressure, "narrow range")))
        assert 160 < within < 240
        assert through_zero == pytest.approx(49.9, rel=0.02)

    def test_a_trap_is_no_adequate_simulation(self, one_pressure: Diagnosis) -> None:
        assert one_pressure.verdict == "unexplained"

    @pytest.mark.bank
    def test_files_together_show_that_the_gain_within_them_is_another(self, measured: Path) -> None:
        names = ("Circle_1bar", "Circle_3bar", "Circle_7bar")
        found = diagnose([_friction(measured, name, "7[N]", "6[bar]") for name in names])
        assert not found.causes
        sentence = _limit(found, "between the files")
        within, between = map(float, re.findall(r"by ([\d.]+) bar/N", sentence))
        assert 1.0 / between == pytest.approx(49.9, rel=0.02)
        assert 1.0 / within > 3.0 / between

    @pytest.mark.parametrize("bar", [1, pytest.param(7, marks=pytest.mark.bank)])
    def test_displacement_against_force_is_a_loop_that_grows_with_pressure(self, measured: Path, bar: int) -> None:
        found = diagnose(_friction(measured, f"Circle_{bar}bar", "5[N]", "7[N]"))
        assert found.verdict == "unexplained"
        assert not found.causes
        sentence = _limit(found, "its direction")
        half_width = float(re.findall(r"lies ([\d.]+) N above", sentence)[0])
        assert half_width == pytest.approx(HALF_WIDTHS_N[bar], rel=0.05)
        assert "several rates" in sentence


class TestLeak:
    def _decay(self, measured: Path, name: str) -> Decay:
        decay = decay_of(_leaking(measured, name))
        assert decay is not None
        return decay

    @pytest.mark.parametrize(("name", "tau_s"), [("Ultimaker_015", 23.0), ("Ultimaker_020", 10.0)])
    def test_leaking_vessels_empty_with_their_time_constants_not_exponentially(
        self, measured: Path, name: str, tau_s: float
    ) -> None:
        decay = self._decay(measured, name)
        # The notes' figure is of the whole record; the valve is closed some seconds after its start.
        assert decay.from_start_s == pytest.approx(tau_s, rel=0.05)
        assert decay.tau_s < decay.from_start_s
        assert decay.course == "slower"
        assert decay.lost_percent > 95

    def test_aluminium_hardly_leaks_and_no_law_is_claimed(self, measured: Path) -> None:
        decay = self._decay(measured, "Aluminium")
        assert decay.lost_percent == pytest.approx(100 * (1 - 7.284 / 7.315), abs=0.05)
        assert decay.course == "undecided"

    def test_without_a_load_the_diagnosis_is_refused_but_says_what_is_seen(self, measured: Path) -> None:
        found = diagnose(_leaking(measured, "Ultimaker_020"))
        assert found.verdict == "refused"
        assert "reference load" in found.limits[0]
        assert "a leak or a relaxation" in _limit(found, "falls by")


class TestInsole:
    @pytest.mark.parametrize(
        "name", ["calibration_dataset", pytest.param("validation_dataset_3", marks=pytest.mark.bank)]
    )
    def test_clocks_come_first_and_no_relaxation_is_named(self, measured: Path, name: str) -> None:
        found = diagnose(_insole(measured, name, INSOLE_ROWS_HZ))
        offset_s = float(re.findall(r"reading is ([\d.]+) s late", _fault(found, "two_clocks"))[0])
        assert offset_s == pytest.approx(INSOLE_LAGS_S[name], abs=0.25)
        assert not {cause.effect.family for cause in found.causes} & {"relaxation", "leak"}
        for cause in found.causes:
            if cause.name == "delay":
                assert cause.parameters["delay"].value == pytest.approx(offset_s, abs=0.25)

    def test_a_wrong_rate_of_the_rows_is_seen_as_a_lag_that_grows(self, measured: Path) -> None:
        name = "experiment_Inf_17September_dynamic_2"
        found = diagnose(_insole(measured, name, 50.0))
        first_s, last_s = (
            float(value)
            for value in re.findall(r"from ([+-][\d.]+) s at the start to ([+-][\d.]+) s", _fault(found, "two_clocks"))[
                0
            ]
        )
        duration_s = 128.0
        assert (last_s - first_s) / duration_s == pytest.approx(50.0 / INSOLE_ROWS_HZ - 1.0, abs=0.006)

    def test_the_lattice_of_a_single_taxel_is_found(self, measured: Path) -> None:
        found = diagnose(_insole(measured, "calibration_dataset", INSOLE_ROWS_HZ, "taxel_0_counts"))
        assert "quantised in steps of 1 counts" in _fault(found, "quantisation")

    def test_a_taxel_that_saturates_is_refused(self, measured: Path) -> None:
        from scipy.io import loadmat

        experiment = loadmat(measured / "insole_plenum" / "calibration_dataset.mat")["experiment"][0, 0]
        rows, reference = experiment["C"].astype(float), experiment["P"].ravel()
        found = diagnose(insole_of(rows[:, 1], rows[:, 2 + SATURATED_TAXEL], reference, INSOLE_ROWS_HZ))
        assert found.verdict == "refused"
        assert "exactly 0 counts" in _fault(found, "saturation")


def _fault(found: Diagnosis, kind: str) -> str:
    said = [fault.says for fault in found.data_faults if fault.kind == kind]
    assert said, f"no fault {kind} in {[fault.kind for fault in found.data_faults]}"
    return said[0]


class TestDamper:
    @pytest.mark.parametrize("name", ["ensaio.A.1", "ensaio.B.5"])
    def test_friction_saturates_with_velocity_and_is_no_linear_damping(self, measured: Path, name: str) -> None:
        file = measured / "mr_damper" / f"{name}.csv"
        found = diagnose(read(file, force="velocity[N]", sensors=["force[N]"]))
        assert found.verdict == "refused"
        assert not found.causes
        sentence = _limit(found, "about the middle")
        middle, ends = map(float, re.findall(r"by ([\d.]+) N/N", sentence))
        assert ends < 0.2 * middle
        assert "saturates" in sentence
        assert "no straight line or linear damping" in sentence


# -- sensors of other laboratories -------------------------------------------------------------------------------
SENSORS = {  # files to fit, files to judge on, the reading's column
    "air": ("air_sweep_fit_*", "air_sweep_hold_*", "pressure_v"),
    "velostat": ("velostat_pike1_fit", "velostat_pike1_hold", "resistance_ohm"),
    "vhb_two_rates": ("vhb_0d0[13]", "vhb_0d05", "position_mm"),
    "vhb_one_rate": ("vhb_0d01", "vhb_0d05", "position_mm"),
    "microfluidic": ("microfluidic_fit_*", "microfluidic_hold_*", "pressure_v"),
}
KINDS = {  # one of which is the first cause, by least-squares ladders over the raw columns, and physics
    "air": {"static_curve"},
    "velostat": {"static_curve"},
    "vhb_two_rates": {"relaxation", "static_curve"},
    "microfluidic": {"static_curve", "relaxation"},
}
POLES_PER_S = np.geomspace(0.01, 30.0, 25)


def sensor_files(measured: Path, pattern: str, column: str) -> list[Recording]:
    paths = sorted((measured / "sensors").glob(f"{pattern}.csv"))
    if not paths:
        pytest.skip(f"no {pattern}.csv among the measured files")
    return [read(path, force="force_n", sensors=[column]) for path in paths]


def _shaken(recordings: list[Recording], seed: int) -> list[Recording]:
    """With noise of a hundred-thousandth of the reading's spread; as they are for seed 0."""
    noise = np.random.default_rng(seed)

    def moved(one: Recording) -> Recording:
        values = one.sensor.values
        by = (1e-5 if seed else 0.0) * np.nanstd(values) * noise.standard_normal(values.size)
        return one.with_channel(replace(one.sensor, values=values + by))

    return [moved(one) for one in recordings]


@cache
def _sensor(measured: Path, name: str, seed: int = 0) -> Diagnosis:
    fit, hold, column = SENSORS[name]
    fitted, judges = sensor_files(measured, fit, column), sensor_files(measured, hold, column)
    return diagnose(_shaken(fitted, seed), hold_out=_shaken(judges, seed + 10 if seed else 0))


def _columns(recording: Recording, pole_per_s: float) -> tuple[Array, Array]:
    """Load and lagged load (n, 2), and the reading (n,), each less its mean: a free offset of each recording."""
    step_s = float(np.median(np.diff(recording.time_s)))
    time_s = np.arange(recording.time_s[0], recording.time_s[-1], step_s)
    load, reading = (np.interp(time_s, recording.time_s, y) for y in (recording.force_n, recording.sensor.values))
    keep = float(np.exp(-pole_per_s * step_s))
    slow = lfilter([1.0 - keep], [1.0, -keep], load, zi=[keep * load[0]])[0]
    columns = np.column_stack([load, slow])
    return columns - columns.mean(axis=0), reading - reading.mean()


def plain_solid_percent(fit: list[Recording], hold: list[Recording]) -> float:
    """Held-out variance explained by a standard linear solid, least squares over a grid of poles."""

    def stacked(recordings: list[Recording], pole: float) -> tuple[Array, Array]:
        parts = [_columns(one, pole) for one in recordings]
        return np.concatenate([a for a, _ in parts]), np.concatenate([y for _, y in parts])

    def fitted(pole: float) -> tuple[float, float, Array]:
        a, y = stacked(fit, pole)
        gains = np.linalg.lstsq(a, y, rcond=None)[0]
        return float(np.sum((y - a @ gains) ** 2)), pole, gains

    _, pole, gains = min((fitted(float(pole)) for pole in POLES_PER_S), key=lambda one: one[0])
    a, y = stacked(hold, pole)
    return 100.0 * (1.0 - float(np.sum((y - a @ gains) ** 2) / np.sum(y**2)))


IN_EVERY_RUN = ("velostat", "vhb_one_rate")  # a diagnosis of the others takes 5 to 15 s: they are of the bank


def _few(names: Iterable[str]) -> list[object]:
    return [name if name in IN_EVERY_RUN else pytest.param(name, marks=pytest.mark.bank) for name in names]


class TestSensors:
    @pytest.mark.parametrize("name", _few(KINDS))
    def test_the_first_cause_is_of_the_right_kind(self, measured: Path, name: str) -> None:
        found = _sensor(measured, name)
        right = [cause for cause in found.causes if cause.effect.family in KINDS[name]]
        assert right
        assert right[0] is found.causes[0]
        assert right[0].held_out.gain_percent > 0
        if name != "vhb_two_rates":  # of which two pulls are fitted: last digits decide what else the model has
            assert right[0].held_out.ci95[0] > 0

    def test_one_rate_in_one_cycle_claims_no_cause_and_says_why(self, measured: Path) -> None:
        found = _sensor(measured, "vhb_one_rate")
        assert not found.causes
        assert "no cause can be told" in _limit(found, "one load cycle")

    @pytest.mark.bank
    @pytest.mark.parametrize("seed", [0, 1, 2])
    def test_two_cycles_tell_two_causes_at_most_and_no_wrong_one(self, measured: Path, seed: int) -> None:
        """The curve in each draw, with noise of a hundred-thousandth as without; what relaxes beside it in some."""
        found = _sensor(measured, "vhb_two_rates", seed)
        families = {cause.effect.family for cause in found.causes}
        assert {"static_curve"} <= families <= KINDS["vhb_two_rates"]
        assert len(found.causes) == len(families)
        assert found.extended is not None
        assert found.extended.variance_explained_percent > 99.0

    @pytest.mark.bank
    @pytest.mark.parametrize("seed", [0, 1, 2])
    def test_of_rates_farther_apart_the_curve_is_told_and_one_cause_beside_it_at_most(
        self, measured: Path, seed: int
    ) -> None:
        """What relaxes in five of eleven draws; a set in two and friction in one of the others, which are wrong."""
        files = _shaken(sensor_files(measured, "vhb_0d0[15]", "position_mm"), seed)
        found = diagnose(files, hold_out=_shaken(sensor_files(measured, "vhb_0d03", "position_mm"), seed + 10))
        families = [cause.effect.family for cause in found.causes]
        assert families.count("static_curve") == 1
        assert len(families) <= 2  # two load cycles
        assert {*families} <= {*KINDS["vhb_two_rates"], "zero", "hysteresis"}
        assert {"power_law_creep", "second_relaxation"} & {*found.minor, *(cause.name for cause in found.causes)}

    @pytest.mark.bank
    @pytest.mark.parametrize("seed", [0, 1, 2])
    def test_a_curve_and_no_wrong_kind_is_told_of_three_rates(self, measured: Path, seed: int) -> None:
        """What relaxes is in the extension, and is named in some draws; last digits hang on the processor, too."""
        found = diagnose(_shaken(sensor_files(measured, "vhb_0d0[135]", "position_mm"), seed))
        assert {"static_curve"} <= {cause.effect.family for cause in found.causes} <= KINDS["vhb_two_rates"]
        assert {"power_law_creep", "second_relaxation"} & {*found.minor, *(cause.name for cause in found.causes)}
        assert found.extended is not None
        assert found.extended.variance_explained_percent > 99.7

    @pytest.mark.bank
    @pytest.mark.parametrize("seed", range(6))
    def test_a_set_is_not_named_of_single_cycles_that_neither_rest_nor_hold(self, measured: Path, seed: int) -> None:
        """It fits in many draws, in the place of a slow relaxation: nothing in the strip's files tells."""
        found = _sensor(measured, "vhb_two_rates", seed)
        assert "zero" not in {cause.effect.family for cause in found.causes}
        assert all("is not named" in said for said in found.limits if said.startswith("permanent set fits"))

    @pytest.mark.bank
    def test_rates_three_times_apart_are_several_though_presses_have_few_samples(self, measured: Path) -> None:
        """The microfluidic sensor was pressed at five speeds, of which a press has 26 samples down to 4."""
        assert not [said for said in _sensor(measured, "microfluidic").limits if "one loading rate only" in said]

    @pytest.mark.bank
    @pytest.mark.parametrize("which", ["as they are", "swapped", "three speeds"])
    def test_the_curve_of_the_microfluidic_sensor_does_not_hang_on_what_is_fitted(
        self, measured: Path, which: str
    ) -> None:
        """No equation follows it, so that nothing is sure; the curve does most by itself, whatever is fitted."""
        fit, hold, column = SENSORS["microfluidic"]
        fitted, judges = sensor_files(measured, fit, column), sensor_files(measured, hold, column)
        if which == "swapped":
            fitted, judges = judges, fitted
        found = diagnose(fitted[::2] if which == "three speeds" else fitted, hold_out=judges)
        assert [cause.effect.family for cause in found.causes] == ["static_curve"]
        assert found.causes[0].confidence <= 0.5
        assert any("by itself it predicts left-out data best" in one.says for one in found.causes[0].evidence)
        assert found.verdict == "partly_explained"
        assert found.extended is not None
        assert found.extended.variance_explained_percent > 96.0

    @pytest.mark.bank
    @pytest.mark.parametrize("seed", [1, 2])
    @pytest.mark.parametrize("name", ["air", "velostat", "vhb_two_rates"])
    def test_the_first_cause_does_not_hang_on_last_digits(self, measured: Path, name: str, seed: int) -> None:
        """Of the microfluidic sensor, which no equation follows, it does: the curve is hardly sure there."""
        found = _sensor(measured, name, seed)
        assert found.causes
        assert found.causes[0].effect.family in KINDS[name]

    @pytest.mark.bank
    @pytest.mark.parametrize("seed", [0, 1])
    def test_where_loads_grow_with_the_clock_nothing_that_goes_with_it_is_sure(self, measured: Path, seed: int) -> None:
        """In the whole record of the air channel the peaks do, so that a drift of the gain follows the curve.

        What is sure at all is the curve, which is there.
        """
        found = diagnose(_shaken(sensor_files(measured, "air_whole", "pressure_v"), seed))
        assert "static_curve" in {cause.effect.family for cause in found.causes}
        for cause in found.causes:
            if cause.effect.family != "static_curve":
                least = Thresholds().least_confidence
                assert cause.confidence <= (0.5 if cause.effect.goes_with_the_clock else least)
        assert "shuffle the loads" in _limit(found, "grow, or fall, with time")
        assert found.verdict in ("partly_explained", "explained")  # where a law of the curve follows
        assert found.extended is not None
        assert found.extended.variance_explained_percent > 98.0

    @pytest.mark.parametrize("name", _few(SENSORS))
    def test_the_baseline_is_as_good_as_a_plain_standard_linear_solid(self, measured: Path, name: str) -> None:
        fit, hold, column = SENSORS[name]
        plain = plain_solid_percent(sensor_files(measured, fit, column), sensor_files(measured, hold, column))
        standing = _sensor(measured, name).to_dict()["baseline"]
        assert standing["variance_explained_percent"] > plain - 2.0, f"a plain fit explains {plain:.1f} %"

    @pytest.mark.parametrize("name", _few(SENSORS))
    def test_the_extension_is_never_worse_than_the_baseline(self, measured: Path, name: str) -> None:
        found = _sensor(measured, name).to_dict()
        before, after = (found[model]["variance_explained_percent"] for model in ("baseline", "extended"))
        assert after >= before
