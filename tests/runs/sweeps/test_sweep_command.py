"""`smartshoe sweep`: one table, the same wherever it is computed and whatever fails on the way."""

from __future__ import annotations

import json
import re
import resource
import shlex
import shutil
import subprocess
from pathlib import Path

import pandas as pd
import pytest
from small_sweeps import SMALL, empty, write_scenario

import smartshoe
from smartshoe.cli import run_command
from smartshoe.errors import DeviceError, InputError, UsageError
from smartshoe.runs.sweeps._folder import SweepFolder
from smartshoe.runs.sweeps._plan import Case, read_plan
from smartshoe.runs.sweeps._repeating import command_of
from smartshoe.runs.sweeps._running import sweep_plan


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the small sweep, computed in this process."""
    folder = tmp_path_factory.mktemp("sweep")
    assert run_command(["sweep", str(write_scenario(folder)), "--out", str(folder / "out"), "--jobs", "1"]) == 0
    return folder / "out"


def test_the_table_has_a_row_a_case_with_keys_seed_and_figures(done: Path) -> None:
    lines = (done / "results.csv").read_text().splitlines()
    assert lines[0].startswith("unit.left_toe.bladder.k1,seed,left_toe.a1,")
    assert [line.split(",")[:2] for line in lines[1:]] == [["1.2", "0"], ["1.2", "1"], ["1.5", "0"], ["1.5", "1"]]
    table = smartshoe.sweep(done.parent / "small.toml", done).table()
    assert abs(table["left_toe.k1"] - table["unit.left_toe.bladder.k1"]).max() < 0.05
    assert len(list((done / "cases").iterdir())) == 4


def test_the_page_names_the_driver_and_the_command_that_repeats_a_case(done: Path, tmp_path: Path) -> None:
    page = (done / "sweep.html").read_text()
    assert "left_toe.rmse_compensated_n" in page
    plan = read_plan(done.parent / "small.toml")
    table = smartshoe.sweep(done.parent / "small.toml", done).table()
    words = shlex.split(command_of(plan, 3))
    assert " ".join(words[5:7]) in page
    words[-1] = str(tmp_path / "again")
    assert run_command([*words[1:]]) == 0
    again = json.loads((tmp_path / "again" / "result.json").read_text())["units"][0]
    assert again["validation"]["overall"]["rmse_compensated_n"] == table["left_toe.rmse_compensated_n"][3]


def test_a_second_run_computes_nothing_and_a_lost_case_is_the_same_again(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", str(done.parent / "small.toml"), "--out", str(done), "--jobs", "1", "--json", "-"]
    files = {path: path.read_bytes() for path in done.rglob("*") if path.is_file()}
    times = {path: path.stat().st_mtime_ns for path in (done / "cases").iterdir()}
    lost = min(times)
    for gone in ([], [lost]):
        for path in gone:
            path.unlink()
        capsys.readouterr()
        assert run_command(words) == 0
        counts = json.loads(capsys.readouterr().out)
        assert (counts["cases"], counts["computed"], counts["failed"]) == (4, len(gone), 0)
        assert {p: p.stat().st_mtime_ns for p in times if p not in gone} == {
            p: t for p, t in times.items() if p not in gone
        }
        assert {path: path.read_bytes() for path in done.rglob("*") if path.is_file()} == files


@pytest.mark.parametrize("processes", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_dask_scheduler_with_two_workers_gives_the_same_bytes(processes: bool, done: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=processes,
        protocol="tcp://",  # within one process too: the address is all that a sweep is given
        dashboard_address=None,
        worker_dashboard_address=None,
    ) as cluster:
        result = smartshoe.sweep(done.parent / "small.toml", tmp_path / "out", scheduler=cluster.scheduler_address)
    assert result.computed == 4
    assert (tmp_path / "out" / "results.csv").read_bytes() == (done / "results.csv").read_bytes()


def test_a_scheduler_that_is_not_there_is_told(
    done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("smartshoe.runs.sweeps._places.ANSWER_S", 0.5)
    words = ["sweep", str(done.parent / "small.toml"), "--out", str(tmp_path / "out")]
    assert run_command([*words, "--scheduler", "tcp://127.0.0.1:1"]) == 4
    assert "no Dask scheduler answers at tcp://127.0.0.1:1" in capsys.readouterr().err
    for address in ("nonsense://x", "127.0.0.1"):
        assert run_command([*words, "--scheduler", address]) == 2
        assert f"--scheduler {address} is no address" in capsys.readouterr().err.splitlines()[-1]


def test_shards_that_share_a_folder_make_the_same_table(
    done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", str(done.parent / "small.toml"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert run_command([*words, "--shard", "2/2"]) == 0
    assert "2 of 4 are other shards'" in capsys.readouterr().out
    assert not (tmp_path / "out" / "results.csv").exists()
    assert run_command([*words, "--shard", "1/2"]) == 0
    assert (tmp_path / "out" / "results.csv").read_bytes() == (done / "results.csv").read_bytes()
    assert run_command([*words, "--shard", "3/2"]) == 2


def test_a_failing_case_is_a_row_with_its_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # A zero far beyond the sensor's range: it says the same whatever the load.
    text = SMALL.replace('bladder.k1" = [1.2, 1.5]', 'sensor.zero_offset_mbar" = [0.0, 1e4]')
    assert (
        run_command(["sweep", str(write_scenario(tmp_path, text)), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 0
    )
    out = capsys.readouterr().out
    assert "4 cases, 2 failed" in out
    rows = (tmp_path / "out" / "results.csv").read_text().splitlines()[1:]
    assert [",failed," in row for row in rows] == [False, False, True, True]
    assert "small.toml, unit left_toe:" in rows[2]
    assert str(tmp_path) not in rows[2]
    assert "2 cases failed" in (tmp_path / "out" / "sweep.html").read_text()


def test_another_sweep_and_another_version_are_kept_out_of_the_folder(tmp_path: Path) -> None:
    plan = read_plan(write_scenario(tmp_path))
    out = tmp_path / "out"
    sweep_plan(plan, out, compute=empty)
    before = {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()}
    another = read_plan(write_scenario(tmp_path, SMALL.replace("[1.2, 1.5]", "[1.2, 1.6]")))
    with pytest.raises(UsageError, match=r"holds another sweep .*2 of its 4 cases are not in this one"):
        sweep_plan(another, out, compute=empty)
    later = read_plan(write_scenario(tmp_path))
    object.__setattr__(later, "version", "99.0")
    with pytest.raises(UsageError, match=r"holds a sweep of smartshoe .*, this is 99\.0: choose another --out"):
        sweep_plan(later, out, compute=empty)
    assert {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()} == before


def test_a_sweep_whose_folder_another_takes_meanwhile_says_so_and_writes_no_table(tmp_path: Path) -> None:
    plan = read_plan(write_scenario(tmp_path))
    another = read_plan(write_scenario(tmp_path, SMALL.replace("[1.2, 1.5]", "[1.2, 1.6]")))
    SweepFolder(tmp_path / "other").claim(another)

    def taken(case: Case) -> str:  # as by a sweep that looked before this one's note was there
        shutil.copy(tmp_path / "other" / "sweep.json", tmp_path / "out" / "sweep.json")
        return empty(case)

    with pytest.raises(UsageError, match="2 of its 4 cases are not in this one"):
        sweep_plan(plan, tmp_path / "out", compute=taken)
    assert not (tmp_path / "out" / "results.csv").exists()


def test_a_plan_of_which_nothing_is_computed_may_be_removed(tmp_path: Path) -> None:
    SweepFolder(tmp_path / "out").claim(read_plan(write_scenario(tmp_path)))
    another = read_plan(write_scenario(tmp_path, SMALL.replace("[1.2, 1.5]", "[1.2, 1.6]")))
    with pytest.raises(UsageError, match="none is computed yet: remove it, or choose another --out"):
        sweep_plan(another, tmp_path / "out", compute=empty)


def test_a_sweep_grows_in_its_folder(tmp_path: Path) -> None:
    out = tmp_path / "out"
    sweep_plan(read_plan(write_scenario(tmp_path)), out, compute=empty)
    grown = read_plan(write_scenario(tmp_path, SMALL.replace("[1.2, 1.5]", "[1.2, 1.35, 1.5]")))
    result = sweep_plan(grown, out, compute=empty)
    assert (result.cases, result.computed) == (6, 2)
    assert list(result.table()["unit.left_toe.bladder.k1"]) == [1.2, 1.2, 1.35, 1.35, 1.5, 1.5]


def test_the_parquet_table_holds_what_the_cases_hold(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    figures = [
        {"left_toe.k1": 1, "left_toe.verdict": "adequate", "left_toe.whole": True},
        {"left_toe.k1": 0.1 + 0.2, "left_toe.verdict": "12", "left_toe.whole": None},
        {},
        {"left_toe.k1": 3, "left_toe.late": None},
    ]
    plan = read_plan(write_scenario(tmp_path))
    of_case = {plan.name(number): own for number, own in enumerate(figures)}

    def given(case: Case) -> str:
        says = None if of_case[case.name] else 'refused: "so",\nand so'
        status = "done" if of_case[case.name] else "failed"
        return json.dumps({"status": status, "says": says, "figures": of_case[case.name]})

    result = sweep_plan(plan, tmp_path / "out", compute=given)
    found = pd.read_parquet(tmp_path / "out" / "results.parquet")
    assert list(found) == list(result.table())
    for name in ("left_toe.k1", "left_toe.verdict", "left_toe.whole", "left_toe.late"):
        assert [None if pd.isna(value) else value for value in found[name]] == [own.get(name) for own in figures]
    assert list(found["seed"]) == [0, 1, 0, 1]
    assert found["says"][2] == 'refused: "so",\nand so'
    assert result.failed == 1


def test_a_page_of_figures_that_nobody_named_tells_of_the_first_that_differs(tmp_path: Path) -> None:
    def other(case: Case) -> str:
        figures = {"left_toe.word": "so", "left_toe.same": 1.0, "left_toe.speed": float(case.seed), "left_toe.last": 2}
        return json.dumps({"status": "done", "says": None, "figures": figures})

    result = sweep_plan(read_plan(write_scenario(tmp_path)), tmp_path / "out", compute=other)
    assert "left_toe.speed" in result.main_table()
    assert "left_toe.last" not in result.main_table()
    assert "left_toe.speed" in result.report.read_text(encoding="utf-8")


def test_a_damaged_case_is_named(tmp_path: Path) -> None:
    plan = read_plan(write_scenario(tmp_path))
    sweep_plan(plan, tmp_path / "out", compute=empty)
    (tmp_path / "out" / "cases" / f"{plan.name(1)}.json").write_text("{")
    with pytest.raises(InputError, match=rf"{plan.name(1)}\.json is damaged .* remove it"):
        sweep_plan(plan, tmp_path / "out", compute=empty)


def test_a_case_that_a_power_cut_left_empty_is_computed_again(tmp_path: Path) -> None:
    plan = read_plan(write_scenario(tmp_path))
    calm = sweep_plan(plan, tmp_path / "out", compute=empty).results.read_bytes()
    (tmp_path / "out" / "cases" / f"{plan.name(1)}.json").write_text("")
    again = sweep_plan(plan, tmp_path / "out", compute=empty)
    assert again.computed == 1
    assert again.results.read_bytes() == calm


def test_a_full_disk_ends_the_sweep_with_a_sentence_and_no_half_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A limit on the size of files is a disk that takes no more, as any process sees it."""
    plan = read_plan(write_scenario(tmp_path))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)

    def on_a_full_disk(case: Case) -> str:
        resource.setrlimit(resource.RLIMIT_FSIZE, (50, limits[1]))
        return empty(case)

    try:
        with pytest.raises(UsageError, match=r"cannot be written .File too large.*nothing half-written is left"):
            sweep_plan(plan, tmp_path / "out", compute=on_a_full_disk)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list((tmp_path / "out" / "cases").iterdir())
    assert sweep_plan(plan, tmp_path / "out", compute=empty).computed == 4


def test_a_fault_of_the_machine_is_no_result_of_the_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def starved(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("smartshoe.runs.sweeps._case.run", starved)
    with pytest.raises(DeviceError, match="MemoryError"):
        smartshoe.sweep(write_scenario(tmp_path), tmp_path / "out", jobs=1)
    assert not list((tmp_path / "out" / "cases").iterdir())


def test_a_fault_of_the_code_costs_one_case_and_is_called_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def faulty(*_: object) -> None:
        raise ZeroDivisionError("by nought")

    monkeypatch.setattr("smartshoe.runs.sweeps._case.run", faulty)
    result = smartshoe.sweep(write_scenario(tmp_path), tmp_path / "out", jobs=1)
    assert result.failed == 4
    assert result.table()["says"].str.startswith("ZeroDivisionError: by nought").all()


def test_the_job_script_of_the_guide_runs_a_shard(done: Path, tmp_path: Path, root: Path) -> None:
    """Without SLURM: the script as it stands, with the variables that SLURM would set, against a stand-in smartshoe."""
    (script,) = re.findall(r"```sh\n(.*?)```", (root / "docs" / "sweep.md").read_text(encoding="utf-8"), re.DOTALL)
    called = tmp_path / "called"
    (tmp_path / "smartshoe").write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" >> {called}\n')
    (tmp_path / "smartshoe").chmod(0o755)
    for task in (1, 2):
        environment = {
            "PATH": f"{tmp_path}:/usr/bin:/bin",
            "SCENARIO": str(done.parent / "small.toml"),
            "OUT": str(tmp_path / "out"),
            "SLURM_ARRAY_TASK_ID": str(task),
            "SLURM_ARRAY_TASK_COUNT": "2",
        }
        called.unlink(missing_ok=True)
        subprocess.run(["sh", "-euc", script], env=environment, check=True)
        words = called.read_text().splitlines()
        assert words[-1] == f"{task}/2"
        words[words.index("--jobs") + 1] = "1"
        assert run_command(words) == 0
    assert (tmp_path / "out" / "results.csv").read_bytes() == (done / "results.csv").read_bytes()
