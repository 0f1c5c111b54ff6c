"""Commands whose output is read by ``head`` or nobody: the work is done, quietly, and the exit status is its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


def _unread(words: list[str], *, both: bool = False) -> tuple[int, str]:
    """Exit status and standard error of a command whose standard output, or ``both``, nobody reads from the start."""
    reader, writer = os.pipe()
    os.close(reader)
    try:
        ended = subprocess.run(
            [sys.executable, "-m", "smartshoe", *words],
            stdout=writer,
            stderr=writer if both else subprocess.PIPE,
            text=True,
            timeout=120,
            check=False,
        )
    finally:
        os.close(writer)
    return ended.returncode, ended.stderr or ""


@pytest.mark.parametrize("both", [False, True])
def test_a_command_that_nobody_reads_writes_its_files_and_ends_well(table: Path, tmp_path: Path, both: bool) -> None:
    calibration, result = tmp_path / "c.json", tmp_path / "r.json"
    words = ["identify", str(table), "--calibration", str(calibration), "--json", str(result)]
    assert _unread(words, both=both) == (0, "")
    assert calibration.is_file()
    assert result.is_file()


def test_a_result_file_that_is_standard_output_may_go_unread(table: Path) -> None:
    assert _unread(["identify", str(table), "--json", "/dev/stdout"]) == (0, "")


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["diagnose", "--help"]])
def test_help_that_nobody_reads_is_no_error(words: list[str]) -> None:
    assert _unread(words) == (0, "")


def test_a_refusal_keeps_its_status_and_its_sentence_though_nobody_reads_the_result(tmp_path: Path) -> None:
    table = tmp_path / "short.csv"
    table.write_text("time_s,force_n,pressure_mbar\n0,0,0\n1,1,1\n")
    status, said = _unread(["diagnose", str(table), "--json", "-"])
    assert status == 5
    assert said.startswith("error: ")


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_a_name_that_the_terminal_cannot_write_is_no_error(encoding: str, table: Path, tmp_path: Path) -> None:
    named = tmp_path / "Zehe \N{LATIN SMALL LETTER U WITH DIAERESIS} \N{CJK UNIFIED IDEOGRAPH-8DB3}.csv"
    named.write_bytes(table.read_bytes())
    ended = subprocess.run(
        [sys.executable, "-m", "smartshoe", "identify", str(named)],
        capture_output=True,
        env={**os.environ, "PYTHONIOENCODING": encoding},
        timeout=120,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, b"")
    assert b"\\u8db3" in ended.stdout


def test_a_program_that_runs_a_command_keeps_its_own_output() -> None:
    script = (
        "import sys; from smartshoe import cli; sys.argv[1:] = ['--version']\ntry: cli.main()\nfinally: print('on')"
    )
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True)
    assert ended.stdout.splitlines()[-1] == "on"


def test_a_stream_ends_when_its_reader_has_gone() -> None:
    status, said = _unread(["stream", "--shoe", "sim:walk?duration_s=1e5"])
    assert status == 0
    assert "error" not in said
