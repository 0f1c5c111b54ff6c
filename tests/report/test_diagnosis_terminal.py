"""A diagnosis on a terminal."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from diagnoses_made import CASES, PLAY_CAUSE, RUN_NEXT, case

from smartshoe.report.diagnosis._sentences import (
    HEADINGS,
)
from smartshoe.report.diagnosis.terminal import print_diagnosis


@pytest.mark.parametrize("name", CASES)
def test_the_terminal_says_the_size_first_then_the_verdict_and_everything_after(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "240")  # wide enough that no number is folded
    made = case(name)
    print_diagnosis(made, "left_toe")
    lines = capsys.readouterr().out.splitlines()
    verdict = f"{HEADINGS[made.verdict]}."
    if made.verdict == "refused":
        assert lines[0] == f"left_toe: {verdict}"
    else:
        assert lines[0].startswith("left_toe: On data that was not fitted, the simulated reading is off by ")
        assert lines[1] == verdict
    said = "\n".join(lines)
    assert not re.search(r"\b(nan|inf|None)\b", said)
    for cause in made.causes:
        assert cause.name.replace("_", " ") in said
        assert f"{cause.held_out.gain_percent:.0f}" in said
    for text in (*made.limits, made.leftover, *(fault.says for fault in made.data_faults)):
        assert text is None or text in said
    if made.causes:
        assert "[0.001941, 0.002059] 1/s" in said
    if made.next_experiment:
        assert RUN_NEXT in said
    if made.minor:
        assert "in the extended model without being causes, too small or too unsure for a name: sensor lag" in said


def test_limits_come_before_recordings_that_were_left_out_and_none_is_cut_off(
    capsys: pytest.CaptureFixture[str],
) -> None:
    left_out = tuple(f"r{k}.csv: the load stands still" for k in range(90))
    limits = tuple(f"limit number {k} of the data" for k in range(20))
    said_first = (f"left out: {why}" for why in left_out)
    print_diagnosis(replace(case("unexplained"), limits=(*said_first, *limits), left_out=left_out))
    said = capsys.readouterr().out
    assert all(limit in said for limit in limits)
    assert said.index(limits[-1]) < said.index("\n- r0.csv: the load stands still") < said.index("and 78 more")


def test_the_terminal_tells_of_a_name_how_far_it_is_this_one(capsys: pytest.CaptureFixture[str]) -> None:
    print_diagnosis(replace(case("one cause"), causes=(PLAY_CAUSE,)))
    said = " ".join(capsys.readouterr().out.split())
    assert "95 %" in said
    assert "62 %" in said
