"""How a column becomes time, load or sensor: by the user's word, else by unit and name, never by a guess."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.errors import InputError, MissingChannelError, UnitError
from smartshoe.files.logs import Column, Sheet, read, write
from smartshoe.files.logs.columns import recording_from
from smartshoe.recording import Channel, Recording, Role
from smartshoe.units import unit

RAMP = np.array([0.0, 1.0, 2.0])


def sheet(*titles: str, format_: str = "tdms", header: bool = True) -> Sheet:
    columns = []
    for title in titles:
        name, _, unit = title.partition("|")
        columns.append(Column(name, unit, RAMP.copy()))
    return Sheet(Path("log.tdms"), format_, columns, has_header=header)


def roles(recording) -> dict[str, str]:
    return {channel.name: channel.role for channel in recording.channels.values()}


def test_units_alone_tell_the_roles() -> None:
    found = recording_from(sheet("Untitled|ms", "Cell|N", "Commanded load|N", "HDI|mbar", "T1|°C", "Travel|mm"))
    assert found.time_s.tolist() == [0.0, 0.001, 0.002]
    assert roles(found) == {
        "force": "load", "command": "command", "pressure": "sensor", "T1": "auxiliary", "Travel": "auxiliary"
    }  # fmt: skip


def test_names_stay_where_the_file_tells_roles() -> None:
    log = sheet("time|s", "cell|N", "port 3|mbar", format_="hdf5")
    log.columns[1].role, log.columns[2].role = "load", "sensor"
    assert roles(recording_from(log)) == {"cell": "load", "port 3": "sensor"}


def test_two_loads_are_left_to_the_user() -> None:
    found = recording_from(sheet("time|s", "Cell A|N", "Cell B|kN"))
    with pytest.raises(MissingChannelError, match="--force"):
        _ = found.load
    chosen = recording_from(sheet("time|s", "Cell A|N", "Cell B|kN"), force="Cell B")
    assert chosen.force_n.tolist() == [0.0, 1000.0, 2000.0]
    assert roles(chosen) == {"Cell A": "auxiliary", "force": "load"}


def test_a_voltage_is_no_load_beside_a_force() -> None:
    found = recording_from(sheet("time|s", "force|V", "cell|N"))
    assert (found.load.unit.symbol, found["force_other"].unit.symbol) == ("N", "V")


def test_a_column_whose_name_the_load_took_is_chosen_by_the_name_that_messages_call_it() -> None:
    log = sheet("time|s", "force|N", "pressure|mbar", format_="plain")
    found = recording_from(log, force="pressure")
    with pytest.raises(MissingChannelError, match=r"--sensor, for example --sensor 'force_other'"):
        _ = found.sensor
    assert roles(recording_from(log, force="pressure", sensors=["force_other"])) == {
        "force_other": "sensor",
        "force": "load",
    }


@given(st.integers(2, 5))
def test_columns_of_one_title_are_chosen_by_the_names_that_messages_call_them(count: int) -> None:
    log = sheet("time|s", "Load|N", *["Pin|V"] * count)
    for k, column in enumerate(log.columns[2:]):
        column.values = column.values + k
    for name, channel in recording_from(log).channels.items():
        if name not in ("force", "Pin"):
            (chosen,) = recording_from(log, sensors=[name]).sensors
            np.testing.assert_array_equal(chosen.values, channel.values)
    for beyond in (1, count + 1):
        with pytest.raises(MissingChannelError, match=f"no column 'Pin_{beyond}'"):
            recording_from(log, sensors=[f"Pin_{beyond}"])


@pytest.mark.parametrize("choice", ["Pin", "pin", "Pin[V]", "3", "3[V]"])
def test_a_sensor_of_any_unit_by_name_or_number(choice: str) -> None:
    found = recording_from(sheet("time|s", "Load|N", "Pin|V", "Other|mbar"), sensors=[choice])
    assert (found.sensor.name, found.sensor.unit.symbol) == ("Pin", "V")
    assert found["Other"].role == "auxiliary"


def test_a_sensors_unit_may_be_any_as_in_a_header_and_a_loads_is_one_that_is_known() -> None:
    log = sheet("t|s", "load|", "grating|")
    found = recording_from(log, force="load[gf]", sensors=["grating[pm]"])
    assert found.sensor.unit.symbol == "pm"
    with pytest.raises(UnitError, match=r"'gram' in --force .* use one such as N, .*gf \(of grams\)"):
        recording_from(log, force="load[gram]", sensors=["grating[pm]"])


def test_a_header_name_wins_over_a_number() -> None:
    found = recording_from(sheet("time|s", "3|V", "Pin|V"), sensors=["3"])
    assert found.sensor.name == "3"


def test_the_unit_in_brackets_tells_namesakes_apart() -> None:
    found = recording_from(sheet("time|s", "Force|V", "Force|N"), force="Force[N]")
    assert found.load.unit.symbol == "N"
    with pytest.raises(InputError, match="fits 2 columns"):
        recording_from(sheet("time|s", "Force|V", "Force|N"), force="Force")


def test_numbers_with_units_where_there_is_no_header() -> None:
    bare = sheet("1", "2", "3", "4", header=False)
    found = recording_from(bare, time="1[ms]", force="2[kN]", sensors=["3[V]", "4[mm]"])
    assert roles(found) == {"force": "load", "sensor_3": "sensor", "sensor_4": "sensor"}
    one = recording_from(bare, time="1[ms]", sensors=["4[mm]"])
    assert one.sensor.name == "sensor"


def test_a_whole_title_goes_before_the_name_of_another() -> None:
    log = sheet("time|s", "Load|N", "Pin|V", "Pin|bar")
    log.columns[2].label, log.columns[3].label = "Pin", "Pin (spare)"
    assert recording_from(log, sensors=["Pin"]).sensor.unit.symbol == "V"
    assert recording_from(log, sensors=["pin"]).sensor.unit.symbol == "V"
    with pytest.raises(InputError, match="fits 2 columns"):
        recording_from(sheet("time|s", "Load|N", "Pin|V", "Pin|bar"), sensors=["Pin"])


FAULTS = [
    ({"time": "9[s]"}, MissingChannelError, "no column '9'.*from 1 to 5"),
    ({"force": "Missing[N]"}, MissingChannelError, "no column 'Missing' for --force"),
    ({"force": "bare"}, InputError, r"no unit.*'bare\[N\]'"),
    ({"sensors": ["bare"]}, InputError, r"no unit.*'bare\[mbar\]'"),
    ({"time": "bare"}, InputError, r"no unit.*'bare\[s\]'"),
    ({"force": "Pin"}, UnitError, r"is in V, which is no force: .* write '\[N\]' behind its name to use its"),
    ({"force": "way"}, UnitError, r"is in mm, which is no force: .* write '\[N\]' behind its name to use its"),
    ({"time": "Load"}, UnitError, "is in N, which is no time"),
    ({"force": "Load[kN]"}, UnitError, "is in N by the file"),
    ({"force": "bare[furlong]"}, UnitError, "furlong"),
    ({"force": "bare[g]"}, UnitError, r"unit 'g' in --force 'bare\[g\]' is a mass: write '\[gf\]'"),
    ({"force": "Load", "sensors": ["Load"]}, InputError, "chosen twice"),
]


@pytest.mark.parametrize("choice", ["way[N]", "way (mm)[N]", "5[N]"])
def test_what_is_no_force_stands_in_the_loads_place_where_brackets_say_so(choice: str) -> None:
    """A unit that is pulled by a way is diagnosed as any other; what the file calls it stays in the notes."""
    log = sheet("time|s", "Load|N", "Pin|V", "bare", "way|mm")
    log.columns[4].label = "way (mm)"
    found = recording_from(log, force=choice, sensors=["Pin"])
    assert (found.load.name, found.load.unit.symbol) == ("force", "N")
    assert found.force_n == pytest.approx(log.columns[4].values)
    assert "Column way is in mm by the file: its numbers are taken for N, as --force says." in found.notes
    with pytest.raises(UnitError, match="is in N by the file, --force says kPa: leave the unit out"):
        recording_from(log, force="Load[kPa]")
    with pytest.raises(UnitError, match="is in V by the file, --sensor says mbar: leave the unit out"):
        recording_from(log, force="Load", sensors=["Pin[mbar]"])


@pytest.mark.parametrize(("choices", "error", "says"), FAULTS)
def test_choices_that_do_not_fit(choices, error, says: str) -> None:
    with pytest.raises(error, match=says) as caught:
        recording_from(sheet("time|s", "Load|N", "Pin|V", "bare", "way|mm"), **choices)
    assert caught.value.exit_status == 3
    assert "log.tdms" in str(caught.value)


def test_a_header_in_grams_says_how_their_weight_is_written() -> None:
    log = sheet("time|s", "Weight|g", "Pin|V")
    with pytest.raises(UnitError, match=r"is in g, which is no force: .* write '\[gf\]' behind its name"):
        recording_from(log, force="Weight")
    assert recording_from(log, force="Weight[gf]").load.unit.symbol == "gf"


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("cap_fF", r"'cap_fF' no unit that is known: .*'cap_fF\[mbar\]' .*counts.*, or 'cap_fF\[fF\]' if fF is one"),
        ("ADC", r"'ADC' no unit: .*'ADC\[counts\]'"),
    ],
)
def test_a_reading_without_a_unit_says_what_its_own_name_suggests(name: str, says: str) -> None:
    log = sheet("time|s", "Load|N", name)
    with pytest.raises(InputError, match=says):
        recording_from(log, sensors=[name])


def test_compression_logged_negative_is_turned_only_in_machine_logs() -> None:
    for format_, sign in (("tdms", 1.0), ("labview", 1.0), ("bluehill", 1.0), ("plain", -1.0), ("hdf5", -1.0)):
        log = sheet("time|s", "force|N", format_=format_)
        log.columns[1].values = -RAMP
        found = recording_from(log)
        assert found.force_n.tolist() == (sign * RAMP).tolist()
        assert bool(found.notes) == (sign > 0)
        assert not np.signbit(found.force_n[0]) or sign < 0


def test_a_doubled_first_row_is_dropped_in_bluehill_logs_only() -> None:
    for format_ in ("bluehill", "tdms"):
        log = sheet("time|s", "force|N", format_=format_)
        log.columns[0].values = np.array([0.0, 0.0, 1.0])
        if format_ == "bluehill":
            assert recording_from(log).time_s.tolist() == [0.0, 1.0]
        else:
            with pytest.raises(InputError, match=r"sample 2: time repeats \(0 s, then 0 s\)"):
                recording_from(log)


def test_a_channel_without_samples() -> None:
    log = sheet("time|s", "force|N", "spare|V")
    log.columns[2].values = np.full(3, np.nan)
    found = recording_from(log)
    assert list(found.channels) == ["force"]
    assert "spare" in found.notes[0]
    with pytest.raises(InputError, match="every sample of column 'spare'"):
        recording_from(log, sensors=["spare"])


def test_rows_without_times_take_a_rate() -> None:
    found = recording_from(sheet("row|", "Load|N", "Pin|V"), time="rows[50Hz]")
    assert found.time_s.tolist() == [0.0, 0.02, 0.04]
    assert "row" in found.channels
    counted = sheet("row|", "Load|N", "Pin|V")
    counted.columns[0].values = np.array([10.0, 12.0, 13.0])
    assert recording_from(counted, time="row[0.05 kHz]").time_s == pytest.approx([0.2, 0.24, 0.26])
    for rate in ("row[0Hz]", "rows", "Rows[10]", "rows []"):
        with pytest.raises(InputError, match=r"no rate above 0: write it like 'rows\[49Hz\]'"):
            recording_from(counted, time=rate)
    with pytest.raises(UnitError, match="unit 'furlong'"):
        recording_from(counted, time="rows[furlong]")
    named = sheet("rows|s", "Load|N", "Pin|V")
    assert recording_from(named, time="rows").time_s.tolist() == named.columns[0].values.tolist()


def test_a_pressure_as_the_reference_is_the_force_on_a_square_centimetre() -> None:
    found = recording_from(sheet("time|s", "chamber|bar", "taxel|counts"), force="chamber", sensors=["taxel"])
    assert found.load.values.tolist() == RAMP.tolist()  # as logged
    assert found.force_n == pytest.approx(10.0 * RAMP)
    assert "1 cm²" in found.notes[-1]


def test_a_force_that_is_read_beside_a_pressure_as_the_load_may_be_exchanged() -> None:
    log = sheet("time|s", "tube|mbar", "Load|N", "film|V")
    assert "exchange --force and --sensor" in recording_from(log, force="tube", sensors=["Load"]).notes[-1]
    for force, sensor in (("tube", "film"), ("Load", "tube"), ("Load", "film")):
        assert not any("exchange" in note for note in recording_from(log, force=force, sensors=[sensor]).notes)


def test_a_choice_that_the_other_log_of_a_pair_holds_is_passed_over() -> None:
    choices = {"time": "row[50Hz]", "force": "chamber", "sensors": ["taxel"]}
    machine = recording_from(sheet("row|", "chamber|bar"), partly=True, **choices)
    logger = recording_from(sheet("time|s", "taxel|counts"), partly=True, **choices)
    assert len(machine.of_role("load")) == 1
    assert not machine.sensors
    assert len(logger.sensors) == 1
    assert not logger.of_role("load")


@pytest.mark.parametrize("ending", ["csv", "mat", "h5", "tdms", "lvm"])
def test_a_file_whose_time_is_not_taken_is_written_with_the_time_that_was(ending: str, tmp_path: Path) -> None:
    count = 50
    table = ["time_s,force_n,pressure_mbar"] + [f"{0.5 * k!r},{float(k)!r},{2.0 * k!r}" for k in range(count)]
    (tmp_path / "dyn.csv").write_text("\n".join(table) + "\n")
    taken = read(tmp_path / "dyn.csv", time="rows[49Hz]")
    write(taken, tmp_path / f"o.{ending}")
    again = read(tmp_path / f"o.{ending}")
    np.testing.assert_array_equal(again.time_s, np.arange(count) / 49.0)
    np.testing.assert_array_equal(again.force_n, taken.force_n)
    np.testing.assert_array_equal(again["time_other"].values, 0.5 * np.arange(count))


def test_two_columns_of_one_name_are_refused_before_one_is_lost() -> None:
    channel = Recording.from_arrays(time_s=RAMP, force_n=RAMP)["force"]
    with pytest.raises(InputError, match="time_s"):
        Recording(RAMP, {"time": channel})
    with pytest.raises(InputError, match="two columns force_n"):
        Recording(RAMP, {"force": channel, "same": channel})


@pytest.mark.parametrize(
    ("header", "is_taken"),
    [
        ("time_s,force_n,sensor_v", True),
        ("time_s,force_n,resistance_ohm", True),
        ("time_s,force_n,Output (mV)", True),
        ("time_s,force_n,displacement_mm", False),  # a machine's crosshead
        ("time_s,force_n,room_c", False),
        ("time_s,force_n,spare", False),  # nobody says what it is in
        ("time_s,force_n,one_v,other_v", False),  # either
    ],
)
def test_the_only_column_beside_the_load_is_the_reading(tmp_path: Path, header: str, is_taken: bool) -> None:
    path = tmp_path / "log.csv"
    count = len(header.split(",")) - 2
    rows = [f"{0.01 * k:.2f},{k}" + f",{2 * k}" * count for k in range(20)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    found = read(path)
    assert [one.values[3] for one in found.sensors] == ([6.0] if is_taken else [])
    assert any("the only one beside the load, is the reading" in note for note in found.notes) is is_taken
    if is_taken:  # what the user names is the user's to name
        with pytest.raises(InputError):
            read(path, sensors=["nothing"])


@pytest.mark.parametrize("ending", ["csv", "lvm", "tdms", "mat", "h5"])
@pytest.mark.parametrize("role", ["auxiliary", "sensor"])
def test_what_a_file_says_of_its_only_other_column_stays(tmp_path: Path, ending: str, role: Role) -> None:
    """What is read along is no reading because it was written beside a load alone."""
    channels = [
        Channel.from_values("force", RAMP, unit("N"), "load"),
        Channel.from_values("voltage", 2.0 * RAMP, unit("V"), role),
    ]
    written = Recording(RAMP, {one.name: one for one in channels}, name="log")
    write(written, tmp_path / f"log.{ending}")
    again = read(tmp_path / f"log.{ending}")
    assert roles(again) == {"force": "load", "voltage": role}
    assert again.notes == ()
