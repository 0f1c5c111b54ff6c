"""The bank: every world apart, against the floors that are asked for.

    pytest -m bank tests/hidden_effects -s --bank-cases 20 --second-lab FOLDER --bank-rows rows.jsonl

prints the tables of each world and the misses. Each test holds one floor, so that one may fail by itself; a world whose
folder is not given is skipped. For developing, `bank_run.py` does the same for chosen ranges of cases.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bank_measured import SETS, is_right
from bank_run import jobs_of, run_all
from bank_tables import ASKED, Figure, figures, judged, report
from bank_worlds import Job

pytestmark = pytest.mark.bank


@pytest.fixture(scope="session")
def rows(request: pytest.FixtureRequest) -> list[dict[str, Any]]:
    """The whole bank, run once."""
    option = request.config.getoption
    first, count = option("--bank-from"), option("--bank-cases")
    ranges = [f"{kind}:{first}-{first + count}" for kind in option("--bank-kinds").split(",")]
    jobs = jobs_of(ranges, "own", "", None)
    if option("--second-lab"):
        jobs += jobs_of(ranges, "second_lab", option("--second-lab"), None)
    sensors = Path(option("--measured")) / "sensors"
    if sensors.is_dir():
        jobs += [Job("measured", name, 0, str(sensors)) for name in SETS]
    path = option("--bank-rows")
    found = []
    for row in run_all(jobs, option("--bank-workers"), Path(path) if path else None):
        found.append(row)
        print(f"\r{len(found)} of {len(jobs)} cases", end="", flush=True)
    report(found, "law")
    return found


def figure(rows: list[dict[str, Any]], world: str, key: str) -> Figure:
    here = [row for row in rows if row["world"] == world]
    if not here:
        pytest.skip(f"no folder of the world {world} is given")
    found = figures(world, judged(here))
    return next(one for one in found if one.key == key)


@pytest.mark.parametrize("world", ASKED)
@pytest.mark.parametrize("key", ASKED["own"])
def test_floor(rows, world, key):
    one = figure(rows, world, key)
    if not one.count:
        pytest.skip("this bank has no such case")
    assert one.met is not False, one.line


def test_no_diagnosis_raises(rows):
    raised = [row for row in rows if "verdict" not in row["found"]]
    assert not raised, f"{len(raised)} raised, the first: {raised[0]['found'].get('traceback', raised[0]['found'])}"


@pytest.mark.parametrize("name", SETS)
def test_a_measured_sensor_is_answered_by_what_is_known_of_it(rows, name):
    here = [row for row in rows if (row["world"], row["kind"]) == ("measured", name)]
    if not here:
        pytest.skip("no folder of the measured sensors is given")
    assert is_right(here[0]), here[0]["found"]
