"""What a sweep's table may say, and the cases that follow from it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_sweeps import SMALL, write_scenario

from smartshoe.cli import run_command
from smartshoe.errors import ScenarioError
from smartshoe.runs.scenario import parse_assignments, with_values
from smartshoe.runs.sweeps._design import design_of
from smartshoe.runs.sweeps._plan import read_plan


def _refuse(path: tuple[str | int, ...], reason: str) -> ScenarioError:
    return ScenarioError(f"{path}: {reason}")


def test_a_grid_has_every_combination_the_last_key_and_then_the_seed_fastest() -> None:
    design = design_of({"seeds": [5, 9], "vary": {"a": [1, 2], "b": {"from": 0.0, "to": 1.0, "count": 3}}}, 0, _refuse)
    rows = [(*design.values(case).values(), design.seed(case)) for case in range(len(design))]
    assert len(rows) == 12
    assert rows[:3] == [(1, 0.0, 5), (1, 0.0, 9), (1, 0.5, 5)]
    assert rows[-1] == (2, 1.0, 9)
    assert len(set(rows)) == 12


def test_keys_may_be_written_as_dotted_tables_too() -> None:
    quoted = design_of({"vary": {"unit.left_toe.bladder.k1": [1.0]}}, 0, _refuse)
    dotted = design_of({"vary": {"unit": {"left_toe": {"bladder": {"k1": [1.0]}}}}}, 0, _refuse)
    assert quoted == dotted


@given(count=st.integers(1, 40), more=st.integers(1, 40), draw=st.integers(0, 2**31))
def test_a_random_design_grows_at_its_end_and_stays_in_its_ranges(count: int, more: int, draw: int) -> None:
    vary = {"a": {"uniform": [-1.0, 3.0]}, "b": {"log_uniform": [0.01, 100.0]}, "c": ["x", "y"]}
    table = {"design": "random", "draw": draw, "vary": vary}
    few, many = (design_of({**table, "count": n}, 0, _refuse) for n in (count, count + more))
    assert [few.values(case) for case in range(count)] == [many.values(case) for case in range(count)]
    for case in range(len(many)):
        values = many.values(case)
        assert -1.0 <= values["a"] < 3.0
        assert 0.01 <= values["b"] <= 100.0
        assert values["c"] in ("x", "y")


def test_log_uniform_draws_are_even_in_the_logarithm() -> None:
    table = {"design": "random", "count": 2000, "vary": {"b": {"log_uniform": [0.01, 100.0]}}}
    design = design_of(table, 0, _refuse)
    below = sum(design.values(case)["b"] < 1.0 for case in range(2000))
    assert abs(below - 1000) < 5 * (2000 * 0.25) ** 0.5


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[sweep]", "[swoop]", "key swoop"),
        ("seeds = [0, 1]", "seed = [0, 1]", "line 14, key sweep.seed"),
        ("seeds = [0, 1]", "seeds = []", "list of whole numbers"),
        ("seeds = [0, 1]", "seeds = [0, -1]", "whole number from 0"),
        ("seeds = [0, 1]", "seeds = [1, 1]", "a seed is there twice"),
        ("seeds = [0, 1]", "seeds = {from = 0}", "{from = 0, count = 100}"),
        ("seeds = [0, 1]", 'design = "latin"', "line 14, key sweep.design"),
        ("seeds = [0, 1]", "count = 3", "means nothing in a grid"),
        ("seeds = [0, 1]", 'design = "random"', "line 13, key sweep.count: give a whole number from 1"),
        ("[1.2, 1.5]", "[]", "no value to take"),
        ("[1.2, 1.5]", "1.2", "give a list"),
        ("[1.2, 1.5]", "{uniform = [1.0, 2.0]}", "random design only"),
        ("[1.2, 1.5]", "{from = 1.0, to = 2.0, count = 0}", "whole number from 1"),
        ("[1.2, 1.5]", "[1.2, -1.5]", 'key sweep.vary.unit.left_toe.bladder.k1: with -1.5'),
        ("unit.left_toe.bladder.k1", "unit.toe.bladder.k1", "line 16, key sweep.vary.unit.toe.bladder.k1: 'unit.toe"),
        ("bladder.k1", "bladder.k7", "line 16, key sweep.vary.unit.left_toe.bladder.k7: with 1.2, this key is not"),
        ("unit.left_toe.bladder.k1", "unit.left_too.bladder.k1", "unit.NAME.KEY with a NAME of left_toe"),
        ("unit.left_toe.bladder.k1", "identify.prefilter", "sweep.vary.identify.prefilter: with 1.2, this key"),
        ("unit.left_toe.bladder.k1", "protocol.dynamic.peek_n", "protocol.dynamic.peek_n"),
        ("unit.left_toe.bladder.k1", "machine.pull", "machine.pull"),
        ("unit.left_toe.bladder.k1", "title.k1", "stands below a value"),
        ("unit.left_toe.bladder.k1", "seed", "seeds = [...]"),
    ],
)  # fmt: skip
def test_faults_are_named_before_anything_is_written(
    old: str, new: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in SMALL
    path = write_scenario(tmp_path, SMALL.replace(old, new, 1))
    assert run_command(["sweep", str(path), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert says in told
    assert not (tmp_path / "out").exists()


def test_an_empty_design_is_one_case_of_the_scenario_itself(tmp_path: Path) -> None:
    text = SMALL.split("[sweep]")[0] + "[sweep]\n"
    plan = read_plan(write_scenario(tmp_path, text))
    assert len(plan) == 1
    assert plan.tables(0) == plan.base


def test_a_case_is_named_by_what_its_figures_depend_on(tmp_path: Path) -> None:
    plan = read_plan(write_scenario(tmp_path))
    assert len(set(plan.names())) == len(plan) == 4
    retold = read_plan(
        write_scenario(tmp_path, SMALL.replace('title = "small"', 'title = "told anew"  # and explained'))
    )
    assert list(retold.names()) == list(plan.names())
    steeper = read_plan(write_scenario(tmp_path, SMALL.replace("[800.0]", "[700.0]")))
    assert not set(steeper.names()) & set(plan.names())
    other = read_plan(write_scenario(tmp_path, SMALL.replace("seeds = [0, 1]", "seeds = [1, 2]")))
    assert len(set(other.names()) & set(plan.names())) == 2


def test_a_file_that_changes_makes_other_cases(tmp_path: Path) -> None:
    from smartshoe.files.logs import write
    from smartshoe.runs.scenario import load, simulate

    for name, recording in simulate(*load(write_scenario(tmp_path)))["left_toe"].items():
        write(recording, tmp_path / f"{name}.csv")
    text = """[[unit]]
name = "left_toe"
recordings = ["dynamic.csv"]
[sweep]
[sweep.vary]
"identify.method" = ["srivc", "trf"]
"""
    before = list(read_plan(write_scenario(tmp_path, text)).names())
    with (tmp_path / "dynamic.csv").open("a") as file:
        file.write("\n")
    assert not set(read_plan(write_scenario(tmp_path, text)).names()) & set(before)


def test_values_are_put_in_their_places_and_the_tables_stay_as_they_were() -> None:
    tables = {"unit": [{"name": "a"}, {"name": "b", "bladder": {"k1": 1.0, "k2": 2.0}}]}
    changed = with_values(tables, {"unit.b.bladder.k1": 9.0, "protocol.dynamic.peak_n": 500})
    assert changed["unit"][1]["bladder"] == {"k1": 9.0, "k2": 2.0}
    assert changed["protocol"] == {"dynamic": {"peak_n": 500}}
    assert tables == {"unit": [{"name": "a"}, {"name": "b", "bladder": {"k1": 1.0, "k2": 2.0}}]}


def test_an_assignment_is_toml_or_a_word() -> None:
    found = parse_assignments(["a.b=1.5", "c=[1, 2]", "identify.method=srivc", 'd="x y"'])
    assert found == {"a.b": 1.5, "c": [1, 2], "identify.method": "srivc", "d": "x y"}
    with pytest.raises(ScenarioError, match="KEY=VALUE"):
        parse_assignments(["a.b"])
