"""How much a command says beside its result: ``--quiet``, ``--verbose``, progress."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from smartshoe.cli import run_command, talk
from smartshoe.cli._output import ShownSteps, progress
from smartshoe.cli.diagnose import with_what_is_left

ROWS = "\n".join(f"{0.01 * k:.2f},{k},{k},good" for k in range(20))


@pytest.mark.parametrize(("flag", "says"), [("", True), ("--quiet", False), ("--verbose", True)])
def test_quiet_leaves_out_notes_wherever_it_stands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], flag: str, says: bool
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"Time (s),Load (N),P (mbar),remark\n{ROWS}\n", encoding="utf-8")
    assert run_command([word for word in (flag, "convert", str(path), str(tmp_path / "out.csv")) if word]) == 0
    assert ("note: " in capsys.readouterr().err) is says
    assert talk.get() == "usual"


def test_warnings_stay_with_quiet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "negated.csv"
    rows = "\n".join(f"{0.01 * k:.2f},{-k},{k}" for k in range(20))
    path.write_text(f"time_s,force_n,pressure_mbar\n{rows}\n", encoding="utf-8")
    assert run_command(["convert", str(path), str(tmp_path / "out.csv"), "--quiet"]) == 0
    assert "compression is positive here, so turn its sign if it presses" in capsys.readouterr().err


@pytest.mark.parametrize(("level", "lines"), [("quiet", 0), ("usual", 0), ("verbose", 2)])
def test_steps_are_lines_with_verbose_and_nothing_in_a_pipe_without(
    capsys: pytest.CaptureFixture[str], level: str, lines: int
) -> None:
    before = talk.set(level)  # type: ignore[arg-type]
    try:
        with progress(2) as step:
            step("one")
            step("two")
    finally:
        talk.reset(before)
    told = capsys.readouterr().err.splitlines()
    assert len(told) == lines
    assert all(line.endswith(word) for line, word in zip(told, ("one", "two"), strict=False))


def test_a_number_of_steps_that_is_known_late_brings_the_time_that_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    with progress() as step:
        step("reading the scenario")
        step.of(2)
        step("one")
        step("two")
    shown = terminal.getvalue()
    assert "two" in shown
    assert "left" in shown


def test_diagnose_tells_the_steps_that_are_usually_left() -> None:
    shown: list[str] = []
    left: list[int] = []
    tell = with_what_is_left(ShownSteps(shown.append, left.append), with_report=True)
    for text in ("fitting the baseline", "fitting play hysteresis", "weighing alternatives"):
        tell(text)
    assert len(shown) == 3
    assert left == [6, 2]


def test_the_help_says_where_the_documentation_lies(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["--help"]) == 0
    shown = capsys.readouterr().out.splitlines()
    (at,) = (k for k, line in enumerate(shown) if "The documentation" in line)
    assert "tour.md" in shown[at]
    assert (Path(shown[at + 1].strip()) / "tour.md").is_file()
