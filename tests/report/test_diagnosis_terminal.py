"""A diagnosis on a terminal."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from diagnoses_made import CASES, LEAK_CAUSE, PLAY_CAUSE, RUN_NEXT, case

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
        assert "in the extended model without being causes, too small, too unsure or without a law: sensor lag" in said


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


def test_the_terminal_tells_of_a_name_how_far_it_is_this_one(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "240")
    print_diagnosis(replace(case("one cause"), causes=(PLAY_CAUSE,)))
    said = " ".join(capsys.readouterr().out.split())
    assert "95 % one of these; if so, 62 % this one" in said


def test_the_terminal_tells_what_parameters_are_and_what_likelihood_is(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once below all causes, where a rival is told; where the width is not known no number is folded."""
    monkeypatch.delenv("COLUMNS", raising=False)
    print_diagnosis(case("two causes"))
    said = capsys.readouterr().out
    assert (
        "  parameters: leak rate (share of the air's deformation lost a second; a held reading falls at 1 - 1/N of it"
        in said
    )
    assert "half height (half of the major loop's greatest height), width (half width of the play" in said
    assert said.count("are differences of −2 log likelihood") == 1
    assert "0.002000 [0.001941, 0.002059] 1/s" in said
    # Of effects that cannot be ruled out no difference is told.
    print_diagnosis(replace(case("one cause"), causes=(replace(LEAK_CAUSE, rivals=()), PLAY_CAUSE)))
    assert "likelihood" not in capsys.readouterr().out


def test_where_the_force_may_be_off_stands_apart_from_other_limits(capsys: pytest.CaptureFixture[str]) -> None:
    off = "no compensator can correct the delay"
    print_diagnosis(replace(case("one cause"), limits=("one rate only", off), limits_of_the_force=(off,)))
    said = capsys.readouterr().out
    assert f"\nwhere the calibration's force may be off\n- {off}\n" in said
    assert "limits of this data\n- one rate only\n" in said
    assert said.count(off) == 1
