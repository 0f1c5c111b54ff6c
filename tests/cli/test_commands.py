"""The command line as its users' scripts see it: outputs, exit statuses, one-sentence errors, nothing half-written."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from smartshoe.cli import _COMMANDS, run_command
from smartshoe.recording import Recording

Table = Callable[..., Path]
HEADER = "time_s,force_n,pressure_mbar\n"


def test_identify_compensate_validate_are_one_line_each(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    calibration, out, result = tmp_path / "c.json", tmp_path / "force.csv", tmp_path / "i.json"
    assert run_command(["identify", str(table), "--calibration", str(calibration), "--json", str(result)]) == 0
    found = json.loads(result.read_text())
    assert found["schema"] == "smartshoe.identification/1"
    assert found["parameters"]["k1"]["value"] == pytest.approx(1.341, rel=0.05)
    assert found["parameters"]["a1"]["unit"] == "1/s"
    assert "a1" in capsys.readouterr().out

    assert run_command(["compensate", str(table), "--calibration", str(calibration), "--out", str(out)]) == 0
    assert out.read_text().splitlines()[0].endswith("force_estimate_n") or "force_estimate_n" in out.read_text()[:500]
    capsys.readouterr()

    assert run_command(["validate", str(table), "--calibration", str(calibration), "--json", "-"]) == 0
    judged = json.loads(capsys.readouterr().out)  # nothing else is on stdout
    assert judged["overall"]["rmse_compensated_n"] < judged["overall"]["rmse_static_n"] < 800


def test_convert_there_and_back_keeps_every_number(table: Path, tmp_path: Path) -> None:
    import smartshoe

    before = smartshoe.read(table)
    for ending in ("h5", "mat", "lvm", "tdms"):
        there, back = tmp_path / f"x.{ending}", tmp_path / f"back_{ending}.csv"
        assert run_command(["convert", str(table), str(there)]) == 0
        assert run_command(["convert", str(there), str(back)]) == 0
        after = smartshoe.read(back)
        np.testing.assert_allclose(after.force_n, before.force_n, rtol=1e-12)
        np.testing.assert_allclose(after.pressure_pa, before.pressure_pa, rtol=1e-12)


BAD_TABLES = {
    "empty": ("", "empty"),
    "header only": (HEADER, "no "),
    "time goes back": (HEADER + "0,1,1\n0.2,1,1\n0.1,1,1\n", "line 4"),
    "duplicated time": (HEADER + "0,1,1\n0.1,1,1\n0.1,1,1\n", "line 4"),
    "not a number": (HEADER + "0,1,1\n0.1,abc,1\n", "line 3"),
    "no load": ("time_s,pressure_mbar\n0,1\n0.1,2\n", "--force"),
    "no sensor": ("time_s,force_n\n0,1\n0.1,2\n", "--sensor"),
    "too short a row": (HEADER + "0,1,1\n0.1,1\n0.2,1,1\n", ""),
}


@pytest.mark.parametrize("fault", BAD_TABLES)
def test_bad_tables_end_in_status_3_and_one_sentence(
    fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, says = BAD_TABLES[fault]
    path, out = tmp_path / "bad.csv", tmp_path / "out.json"
    path.write_text(text)
    status = run_command(["identify", str(path), "--json", str(out)])
    last = capsys.readouterr().err.strip().splitlines()[-1]
    if fault == "too short a row":  # an empty cell is a missing sample; there is just too little left to fit
        assert status in (3, 5)
    else:
        assert status == 3
        assert "bad.csv" in last
    assert says in last
    assert not out.exists()


def test_binary_directory_and_missing_file_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    binary = tmp_path / "noise.csv"
    binary.write_bytes(bytes(range(256)) * 20)
    for path in (binary, tmp_path, tmp_path / "nowhere.csv"):
        assert run_command(["identify", str(path)]) == 3
        assert path.name in capsys.readouterr().err.splitlines()[-1]


def test_a_constant_cannot_be_identified(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flat.csv"
    path.write_text(HEADER + "".join(f"{k / 100},100,50\n" for k in range(500)))
    assert run_command(["identify", str(path), "--calibration", str(tmp_path / "c.json")]) == 5
    assert "error:" in capsys.readouterr().err
    assert not (tmp_path / "c.json").exists()


@pytest.mark.parametrize(
    "text", ["", "{", '{"schema": "other/1"}', '{"schema": "smartshoe.calibration/1"}', "[1]", "\x00\x01"]
)
def test_truncated_and_foreign_calibrations_are_refused(
    text: str, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "c.json"
    path.write_text(text)
    assert run_command(["compensate", str(table), "--calibration", str(path), "--out", str(tmp_path / "o.csv")]) == 3
    assert "c.json" in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "o.csv").exists()


@pytest.mark.parametrize(
    "words",
    [
        "run s.toml --out new --json nowhere/x.json",
        "identify t.csv --calibration c.json --json nowhere/x.json",
        "identify t.csv --json x.json --calibration nowhere/c.json",
        "compensate t.csv --calibration c.json --out nowhere/x.csv",
        "validate t.csv --calibration c.json --json nowhere/x.json",
        "diagnose t.csv --out new --json nowhere/x.json",
        "diagnose t.csv --out new --calibration nowhere/c.json",
        "diagnose t.csv --out here.txt/new",
        "diagnose t.csv --json new/x.json",
        "convert t.csv nowhere/x.csv",
        "gait t.csv --out new --c3d nowhere/x.c3d",
        "check t.csv --json nowhere/x.json",
        "study s.toml --out new --json nowhere/x.json",
        "sweep s.toml --out new --json nowhere/x.json",
        "calibrate --shoe sim:stand --machine sim:instron --unit u --protocol static --out new --json nowhere/x.json",
        "calibrations show c.json --out nowhere/x.json",
        "calibrations drift u --out new --json nowhere/x.json",
        "calibrations add c.json --json nowhere/x.json",
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_anything_is_read(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """No input is there, so that whatever is told of is the output."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.txt").touch()
    assert run_command(words.split()) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert re.search(r"nowhere|here\.txt|new/x\.json", said)
    assert "choose" in said
    assert [path.name for path in tmp_path.iterdir()] == ["here.txt"]


@pytest.mark.parametrize(
    "words",
    [
        "identify t.csv --json t.csv",
        "identify other.csv t.csv --calibration ./t.csv",
        "validate t.csv --calibration c.json --json t.csv",
        "validate other.csv --calibration t.csv --json t.csv",
        "diagnose t.csv --json t.csv",
        "diagnose t.csv --calibration link.csv",
        "diagnose other.csv --hold-out t.csv --out new --json t.csv",
        "diagnose other.csv --json same.json --calibration same.json",
        "diagnose --design t.csv --json t.csv",
        "gait t.csv --json t.csv",
        "gait other.csv --calibration t.csv --c3d t.csv",
        "check t.csv --json t.csv",
        "run t.csv --json t.csv",
        "sweep t.csv --out new --json t.csv",
        "study t.csv --out new --json t.csv",
        "compensate t.csv --calibration c.json --out t.csv",
        "compensate other.csv --calibration t.csv --out ./t.csv",
        "convert t.csv t.csv",
        "convert t.csv link.csv",
        "calibrations add t.csv --json t.csv",
    ],
)
def test_a_result_replaces_neither_what_is_read_nor_another_result(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text("measured once")
    (tmp_path / "link.csv").symlink_to("t.csv")
    assert run_command(words.split()) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert re.search(
        r"error: \S+ is (read, and the result would replace it|to hold two results): give another name", said
    )
    assert (tmp_path / "t.csv").read_text() == "measured once"
    assert {path.name for path in tmp_path.iterdir()} == {"t.csv", "link.csv"}


def test_a_result_may_lie_in_the_folder_that_is_made(table: Path, tmp_path: Path) -> None:
    from smartshoe.cli._output import require_writable

    require_writable(str(tmp_path / "new" / "x.json"), None, json_path="-", folder=str(tmp_path / "new"))
    require_writable("x.json", "/dev/null", folder=str(table.parent / "a" / "b"))
    require_writable("/dev/null", "/dev/null", json_path="-", read=["/dev/null", "-"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        *(
            (words, "- is standard output, which only --json writes to: give the name of a file")
            for words in (
                "identify t.csv --calibration -",
                "diagnose t.csv --json - --calibration -",
                "compensate t.csv --calibration c.json --out -",
                "convert t.csv -",
                "gait t.csv --c3d -",
                "stream --shoe sim:stand --out -",
                "live --shoe sim:stand --record -",
                "calibrations show c.json --out -",
            )
        ),
        *(
            (words, "--out is '-', which names no folder: give the name of one")
            for words in (
                "run s.toml --out -",
                "simulate s.toml --out -",
                "sweep s.toml --out -",
                "study s.toml --out -",
                "gait t.csv --out -",
                "diagnose t.csv --out -",
                "export c.json --to c --out -",
                "calibrate --out -",
            )
        ),
        ("identify t.csv --json=", "the name of a file to write is empty: give one"),
        ("compensate t.csv --calibration c.json --out=", "the name of a file to write is empty: give one"),
        ("run s.toml --out=", "--out is '', which names no folder"),
    ],
)
def test_a_dash_or_nothing_names_no_file_and_no_folder(
    words: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As of a script whose variable was never set, or that takes - for standard output everywhere."""
    monkeypatch.chdir(tmp_path)
    assert run_command(words.split()) == 2
    assert said in capsys.readouterr().err.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("gait none.csv --out a/new", 3),
        ("gait table.csv --out a/new", 3),
        ("gait empty.csv --stream --out a/new", 3),
        ("diagnose none.csv --out a/new", 3),
        ("diagnose left.csv right.csv --out a/new", 2),
        ("run faulty.toml --out a/new", 3),
        ("simulate faulty.toml --out a/new", 3),
        ("study study.toml --out a/new --c3d", 5),
    ],
)
def test_a_failed_command_leaves_no_folder(
    words: str, status: int, table: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Each of them has read a part of its input before it fails."""
    monkeypatch.chdir(tmp_path)
    table.rename("table.csv")
    (tmp_path / "empty.csv").touch()
    for unit in ("left", "right"):
        (tmp_path / f"{unit}.csv").write_text(f"# unit: {unit}_toe\n{(tmp_path / 'table.csv').read_text()}")
    (tmp_path / "faulty.toml").write_text(
        '[[unit]]\nname = "left_toe"\nrecordings = ["table.csv", "none.csv"]\n[identify]\nuse = ["table"]\n'
    )
    (tmp_path / "study.toml").write_text('[[trial]]\nfile = "none.csv"\nsubject = "Anna"\ncondition = "shod"\n')
    before = sorted(tmp_path.iterdir())
    assert run_command(words.split()) == status
    assert capsys.readouterr().err.splitlines()[-1].startswith("error: ")
    assert sorted(tmp_path.iterdir()) == before


def test_a_recording_that_is_named_twice_counts_once(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["identify", str(table), "--json", "-"]) == 0
    once = capsys.readouterr().out
    again = str(table.parent / "." / ".." / table.parent.name / table.name)
    assert run_command(["identify", str(table), again, "--json", "-"]) == 0
    told = capsys.readouterr()
    assert told.out == once
    assert told.err == f"warning: {again} is named twice and counts once\n"


def test_a_warning_is_one_line_whatever_a_file_is_called(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    negated = tmp_path / "line one\nline two\x1b[31m.csv"
    negated.write_text(HEADER + "".join(f"{k / 10},{-abs(k % 40 - 20)},{k % 40}\n" for k in range(400)))
    assert run_command(["convert", str(negated), str(tmp_path / "out.csv")]) == 0
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert r"line one line two\x1b[31m.csv goes from" in said


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["0,1,2", "1,1,3", "2,1,4", "3,1,5"], "t.csv: the load never moves, so that nothing can be judged by it"),
        (["0,1,2", "1,2,2", "2,3,2"], "t.csv: the reading never moves, so that nothing can be judged by it"),
        (["0,1,2", "1,2,3"], "t.csv holds 2 samples with both load and reading"),
    ],
)
def test_what_judges_nothing_is_refused(
    rows: list[str], said: str, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    calibration = str(tmp_path / "c.json")
    assert run_command(["identify", str(table), "--calibration", calibration]) == 0
    (tmp_path / "t.csv").write_text(HEADER + "\n".join(rows))
    assert run_command(["validate", str(tmp_path / "t.csv"), "--calibration", calibration]) == 3
    assert said in capsys.readouterr().err.splitlines()[-1]


def test_an_editors_mark_before_a_file_is_no_part_of_it(table: Path, tmp_path: Path) -> None:
    """Windows' Notepad writes it before UTF-8."""
    calibration, scenario = tmp_path / "c.json", tmp_path / "s.toml"
    assert run_command(["identify", str(table), "--calibration", str(calibration)]) == 0
    calibration.write_bytes(b"\xef\xbb\xbf" + calibration.read_bytes())
    assert run_command(["validate", str(table), "--calibration", str(calibration)]) == 0
    scenario.write_text('\ufeff[machine]\nbackend = "sim:instron"\n[protocol.dynamic]\n[[unit]]\nname = "toe"\n')
    assert run_command(["diagnose", "--design", str(scenario), "--json", str(tmp_path / "d.json")]) == 0


def test_places_that_cannot_be_written_end_in_status_2(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(["convert", str(table), str(tmp_path / "missing" / "x.csv")]) == 2
    assert "missing" in capsys.readouterr().err.splitlines()[-1]
    assert run_command(["convert", str(table), str(tmp_path / "x.unknown")]) == 2
    assert "unknown" in capsys.readouterr().err.splitlines()[-1]


PAST = "continues first: the filter begins as after a rest, without what drift, set, softening and leak had done by"


@pytest.mark.parametrize("command", ["compensate", "validate"])
@pytest.mark.parametrize(
    ("is_continued", "is_extended", "is_warned"),
    [(True, True, True), (True, False, False), (False, True, False), (False, False, False)],
)
def test_a_past_that_a_filter_with_effects_does_not_know_is_warned_of(
    command: str,
    is_continued: bool,
    is_extended: bool,
    is_warned: bool,
    table: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Effects remember what went before; the plain filter forgets it by its pole, within seconds."""
    from dataclasses import replace

    from smartshoe.calibration import Calibration
    from smartshoe.units import MILLIBAR

    plain = Calibration(a1=0.2, b0=3.6, b1=0.85, reading_unit=MILLIBAR, unit="left_toe")
    calibration, later = tmp_path / "c.json", tmp_path / "later.csv"
    (replace(plain, extended=plain.model()) if is_extended else plain).save(calibration)
    later.write_text(f"# continues: first\n{table.read_text()}" if is_continued else table.read_text())
    assert run_command([command, str(later), "--calibration", str(calibration), "--quiet"]) == 0
    said = capsys.readouterr().err
    assert (f"warning: {later} {PAST}" in said) is is_warned
    assert ("join the two files to carry it over" in said) is is_warned


def test_of_several_recordings_each_with_a_past_is_warned_of(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from dataclasses import replace

    from smartshoe.calibration import Calibration
    from smartshoe.units import MILLIBAR

    plain = Calibration(a1=0.2, b0=3.6, b1=0.85, reading_unit=MILLIBAR)
    replace(plain, extended=plain.model()).save(tmp_path / "c.json")
    text = table.read_text()
    for name, before in (("second", "# continues: first\n"), ("third", "# continues: second\n"), ("alone", "")):
        (tmp_path / f"{name}.csv").write_text(before + text)
    files = [str(tmp_path / f"{name}.csv") for name in ("second", "alone", "third")]
    assert run_command(["validate", *files, "--calibration", str(tmp_path / "c.json")]) == 0
    told = [line.split(":")[1].strip() for line in capsys.readouterr().err.splitlines() if "continues" in line]
    assert told == [f"{files[0]} continues first", f"{files[2]} continues second"]


@pytest.mark.parametrize("words", [["identify"], ["nonsense"], ["identify", "x.csv", "--method", "magic"], ["run"]])
def test_wrong_command_lines_end_in_status_2(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(words) == 2
    assert capsys.readouterr().err.startswith("error:")


@pytest.mark.parametrize("words", [[], ["calibrations"]])
def test_no_command_at_all_shows_the_commands_and_ends_in_one_sentence(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(words) == 2
    shown, last = capsys.readouterr().err.strip().rsplit("\n", 1)
    assert "Commands:" in shown
    assert last == f"error: no command is given: name one of these; see {' '.join(['smartshoe', *words])} --help"


@pytest.mark.parametrize("command", _COMMANDS)
def test_every_command_has_help_with_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command([command, "--help"]) == 0
    assert re.search(rf"Example: smartshoe {command}", capsys.readouterr().out)


def test_help_imports_nothing_heavy() -> None:
    import subprocess
    import sys

    code = (
        "import sys\nfrom smartshoe.cli import run_command\nrun_command(['--help'])\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'numba', 'matplotlib', 'pydantic', 'rich'} & set(sys.modules)\n"
        "sys.exit(', '.join(heavy) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "identify" in done.stdout


@pytest.mark.real_data
def test_the_pneumatic_actuators_file_is_identified_and_judged(
    measured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Circle_3bar: no header, tabs, milliseconds; supply pressure as the sensor, load cell as the force."""
    file = str(measured / "pneumatic_actuator_friction_leak" / "friction" / "Circle_3bar.csv")
    columns = ["--time", "1[ms]", "--force", "7[N]", "--sensor", "6[bar]"]
    calibration = str(tmp_path / "c.json")
    assert run_command(["identify", file, *columns, "--calibration", calibration, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["b0"]["unit"] == "N/bar"
    assert run_command(["validate", file, *columns, "--calibration", calibration, "--json", "-"]) == 0
    judged = json.loads(capsys.readouterr().out)
    # The filter with a free zero contains the static line, so on its own data it cannot be worse.
    assert 0.0 < judged["overall"]["rmse_compensated_n"] <= judged["overall"]["rmse_static_n"]


def test_recording_of_the_contract_reads_back(tmp_path: Path) -> None:
    import smartshoe

    recording = Recording.from_arrays(time_s=[0, 0.01], force_n=[0, 1], pressure_mbar=[0, 2], name="n", unit="left_toe")
    smartshoe.write(recording, tmp_path / "n.csv")
    again = smartshoe.read(tmp_path / "n.csv")
    assert again.unit == "left_toe"
    assert again.name == "n"


def test_checks_say_what_repeats_and_what_each_rate_does(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from smartshoe.devices import open_machine
    from smartshoe.files.logs import write
    from smartshoe.protocol import dynamic_protocol

    with open_machine("sim:instron", unit="left_toe", seed=5) as machine:
        write(machine.run(dynamic_protocol((200.0, 800.0), repeats=3)), tmp_path / "both.csv")
        write(machine.run(dynamic_protocol((400.0,))), tmp_path / "one.csv")
    assert (
        run_command(["identify", str(tmp_path / "both.csv"), "--checks", "--json", str(tmp_path / "found.json")]) == 0
    )
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["lack_of_fit"]["n_cycles"] == 6
    assert [round(fold["rate_n_per_s"] / 100) for fold in found["leave_one_rate_out"]["folds"]] == [2, 8]
    capsys.readouterr()
    assert run_command(["identify", str(tmp_path / "one.csv"), "--checks"]) == 0
    assert "not tested" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--fix", "c"], "NAME=VALUE"),
        (["--structure", "grey_box", "--bound", "k1=3"], "NAME=LOW:HIGH"),
        (["--offset", "none"], "--offset"),
        (["--fix", "c=1"], "grey box"),
    ],
)
def test_wrong_choices_of_the_fit_are_named(
    words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from smartshoe.devices import open_machine
    from smartshoe.files.logs import write
    from smartshoe.protocol import dynamic_protocol

    with open_machine("sim:instron", unit="left_toe", seed=5) as machine:
        write(machine.run(dynamic_protocol((800.0,))), tmp_path / "one.csv")
    assert run_command(["identify", str(tmp_path / "one.csv"), *words]) == 2
    assert says in capsys.readouterr().err.splitlines()[-1]


def test_one_choice_of_columns_serves_both_logs_of_a_pair(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A reference in rows and bar, a sensor in counts with times of its own: joined by what both follow."""
    time_s = np.arange(0.0, 60.0, 0.02)
    chamber_bar = 1.0 + np.interp(time_s % 12.0, [0.0, 6.0, 12.0], [0.0, 2.0, 0.0]) * (0.5 + time_s // 12.0 % 2)
    rows = "\n".join(f"{k},{value:.5f}" for k, value in enumerate(chamber_bar))
    (tmp_path / "chamber.csv").write_text(f"row,P\n{rows}\n")
    slow = np.empty_like(chamber_bar)
    slow[0] = chamber_bar[0]
    for k in range(1, slow.size):
        slow[k] = slow[k - 1] + 0.02 / 3.0 * (chamber_bar[k] - slow[k - 1])
    counts = 240.0 - np.interp(time_s - 0.5, time_s, 30.0 * chamber_bar + 10.0 * slow)
    taxel = "\n".join(f"{t:.3f},{value:.3f}" for t, value in zip(time_s, counts, strict=True))
    (tmp_path / "taxel.csv").write_text(f"t_s,taxel_counts\n{taxel}\n")
    files = [str(tmp_path / name) for name in ("chamber.csv", "taxel.csv")]
    columns = ["--time", "row[50Hz]", "--force", "P[bar]", "--sensor", "taxel_counts"]
    assert run_command(["identify", *files, *columns, "--json", str(tmp_path / "found.json")]) == 0
    said = capsys.readouterr().err
    assert "joined with" in said
    found = json.loads((tmp_path / "found.json").read_text())
    gain = found["parameters"]["b1"]["value"] / found["parameters"]["a1"]["value"]
    assert gain == pytest.approx(-10.0 / 40.0, rel=0.02)  # N on 1 cm² for each count
    assert run_command(["identify", files[1], *columns]) == 3


@pytest.mark.parametrize("command", ["identify", "gait"])
def test_an_error_lists_ten_columns_at_most(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wide.csv"
    rows = "".join(f"{k}" + ",1" * 40 + "\n" for k in range(3))
    path.write_text("time_s," + ",".join(f"part{k}" for k in range(40)) + "\n" + rows)
    assert run_command([command, str(path)]) == 3
    said = capsys.readouterr().err
    assert "part8" in said
    assert "part12" not in said
    assert "more" in said


def test_a_line_of_a_million_cells_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "long.csv"
    path.write_text("time_s,force_n,pressure_mbar\n" + "1," * 1_000_000 + "\n0,1,2\n")
    assert run_command(["identify", str(path)]) == 3
    assert "line 2 has 1000001 cells" in capsys.readouterr().err
