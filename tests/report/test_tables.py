"""Tables for a terminal: within its width, and nothing cut."""

from __future__ import annotations

import pytest

from smartshoe.cli import run_command
from smartshoe.report.tables import print_summary, table_of

PARAMETER = {"value": 1.34098765, "sd": 0.000612}


def _unit(name: str) -> dict[str, object]:
    overall = dict.fromkeys(
        ("rmse_static_n", "rmse_compensated_n", "improvement_over_static_percent", "hysteresis_raw_percent",
         "hysteresis_compensated_percent"),
        12.3,
    )  # fmt: skip
    found = {"parameters": dict.fromkeys(("k1", "k2", "c"), PARAMETER), "fit_percent": 99.5}
    return {"unit": name, "identification": found, "validation": {"overall": overall}}


@pytest.mark.parametrize("columns", ["", "80", "100"])
def test_a_run_s_tables_fit_the_width_and_cut_nothing(
    columns: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    print_summary(
        [_unit("right_heel"), _unit("left_toe")], "1 of 2 units good.", {"right_heel": "good", "left_toe": "bad"}
    )
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "1 of 2 units good."
    assert max(len(line.rstrip()) for line in said) <= int(columns or 120)
    assert "…" not in "".join(said)
    assert sum("1.34099±0.00061" in line for line in said) == 2


def test_a_column_s_header_may_take_lines() -> None:
    assert [column.min_width for column in table_of("t", ["unit", "loop\ncomp."]).columns] == [4, 5]


@pytest.mark.parametrize(("word", "told"), [("calibrat", "did you mean calibrate?"), ("qqq", "the commands are run")])
def test_a_misspelt_command_is_told_the_nearest(word: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command([word]) == 2
    assert told in capsys.readouterr().err
