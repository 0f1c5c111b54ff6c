"""What asks for more than the limits is refused before memory is taken; numbers that are none are refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from contract import ended

from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore
from smartshoe.devices import open_machine, open_shoe
from smartshoe.errors import LimitError, OptionError, UsageError
from smartshoe.files.gate import limits, raise_limits
from smartshoe.protocol import Protocol, Segment
from smartshoe.runs.session import SessionFolder, SessionPlan
from smartshoe.units import MILLIBAR

LONG = Protocol("long", (Segment("ramp", 100.0, 3000.0), Segment("hold", 100.0, 3000.0)))
ESCAPE = "\x1b[31m"


def test_a_pressing_of_too_many_samples_is_refused_before_it_runs() -> None:
    with open_machine("sim:instron") as machine:
        with pytest.raises(LimitError, match=r"--limit samples=6000000$"):
            machine.check(LONG)
        try:
            raise_limits(["samples=6e6"])
            machine.check(LONG)
        finally:
            raise_limits([])
    with pytest.raises(UsageError, match="is not known"):
        raise_limits(["sample=1"])
    assert limits().samples == 5_000_000  # a wrong setting leaves what held
    with open_machine("sim:instron", fine_rate_hz=100_000.0) as fine, pytest.raises(LimitError, match="samples"):
        fine.check(Protocol("short", (Segment("ramp", 100.0, 60.0),)))


@pytest.mark.parametrize("option", ["duration_s=1e12", "sample_rate_hz=1e-300", "block_samples=1000000000", "x=1"])
def test_a_simulated_shoe_without_bounds_is_refused(option: str) -> None:
    with pytest.raises(OptionError, match=option.partition("=")[0]):
        open_shoe(f"sim:walk?{option}")


@pytest.mark.parametrize("number", ["nan", "inf", "1e400"])
def test_a_number_that_is_none_is_refused_on_the_command_line(number: str, tmp_path: Path) -> None:
    found = ended(["stream", "--shoe", "sim:stand", "--duration", number], tmp_path)
    assert found.status == 2
    assert "finite" in found.last_line


def test_what_a_terminal_would_obey_stands_in_no_name(tmp_path: Path) -> None:
    table = tmp_path / "x.csv"
    table.write_text(f"# name: {ESCAPE}\ntime_s,force_n,{ESCAPE}_mbar\n0,1,2\n1,2,3\n2,3,4\n")
    found = ended(["convert", str(table), str(tmp_path / "o.csv")], tmp_path)
    assert found.status == 0
    assert ESCAPE not in found.out + found.err + (tmp_path / "o.csv").read_text()
    store = CalibrationStore(tmp_path / "store")
    for enter in (
        lambda: store.place(ESCAPE, "left_toe", "2026-01-01"),
        lambda: store.place("7", ESCAPE, "2026-01-01"),
    ):
        with pytest.raises(UsageError, match="cannot be printed"):
            enter()
    assert not (tmp_path / "store").exists()


@pytest.mark.parametrize(
    "table",
    [
        "seeds = {from = 0, count = 1000000000000}",
        'design = "random"\ncount = 1000000000000\n[sweep.vary]\n"unit.x.bladder.k1" = {uniform = [1, 2]}',
        '[sweep.vary]\n"unit.x.bladder.k1" = {from = 1, to = 2, count = 1000000000}',
        "seeds = {from = 0, count = 900000}\n[sweep.vary]\nseedling = [1, 2]",
    ],
)
def test_a_sweep_without_bounds_is_refused(table: str, tmp_path: Path) -> None:
    scenario = tmp_path / "s.toml"
    scenario.write_text(f'[protocol.dynamic]\n[[unit]]\nname = "x"\n[sweep]\n{table}\n')
    found = ended(["sweep", str(scenario), "--out", str(tmp_path / "out")], tmp_path)
    assert found.status == 2
    assert "more than 1000000 cases" in found.last_line


def test_a_coefficient_near_the_end_of_numbers_fits_no_fixed_point(tmp_path: Path) -> None:
    Calibration(1e308, 5.0, 1.0, MILLIBAR, unit="left_toe").save(tmp_path / "c.json")
    words = ["export", str(tmp_path / "c.json"), "--to", "c", "--out", str(tmp_path / "c"), "--fixed", "q15"]
    assert ended(words, tmp_path).status == 2


def test_a_session_from_elsewhere_makes_no_store(tmp_path: Path) -> None:
    plan = SessionPlan(shoe="sim:stand", machine="sim:instron", unit="left_toe", protocols=(LONG,), serial_number="7",
                store=str(tmp_path / "elsewhere"))  # fmt: skip
    SessionFolder.begin(tmp_path / "session", plan).close()
    for word in ("--resume", "--replay"):
        found = ended(["calibrate", word, str(tmp_path / "session")], tmp_path)
        assert found.status == 2
        assert "say with --store" in found.last_line
