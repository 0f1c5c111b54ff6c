"""The bank: how often the name is right, over seeds that no threshold was developed on.

    pytest -m bank tests/hidden_effects -s --bank-cases 100 --bank-out bank

prints the figures that are asked for, the table by effect and strength and the cases that went wrong, and writes them
with every row and the confusion matrix to the folder. Each test holds one floor, so that one may fail by itself.
"""

from __future__ import annotations

import statistics
import time
from pathlib import Path

import pytest
from bank import INSIDE, SETS, Row, drawn, read, run_all, write
from bank_figures import Figure, draw_confusion, failures, figures
from bank_report import Findings, markdown

from simulators.hidden import hide
from smartshoe.diagnosis import diagnose

pytestmark = pytest.mark.bank

TIMED = 12
TIMED_SEED = 600_000
TIMED_RATE_HZ = 90.0  # three records of the rates are then 73,000 samples


@pytest.fixture(scope="session")
def rows(request: pytest.FixtureRequest, findings: Findings) -> list[Row]:
    """The whole bank, run once."""
    given = request.config.getoption("--bank-rows")
    if given is not None:
        found = read(Path(given))
    else:
        first, count = (request.config.getoption(name) for name in ("--bank-from", "--bank-cases"))
        sets = request.config.getoption("--bank-sets").split(",")
        cases = [drawn(kind, index) for index in range(first, first + count) for kind in sets]
        found = []
        for row in run_all(cases, request.config.getoption("--bank-workers")):
            found.append(row)
            print(f"\r{len(found)} of {len(cases)} cases", end="", flush=True)
        found.sort(key=lambda row: (*SETS, "calibrate").index(row.kind) * 1_000_000 + row.index)
    findings.rows = found
    return found


@pytest.fixture(scope="session")
def cpu_s(request: pytest.FixtureRequest) -> list[float]:
    """Seconds of processor time of one diagnosis of 73,000 samples; the first one, which compiles, is left out."""
    if request.config.getoption("--bank-rows") is not None:
        return []
    spent = []
    for k in range(TIMED + 1):
        name = INSIDE[(3 * k) % len(INSIDE)]
        case = hide({name: 0.5}, seed=TIMED_SEED + k, recordings=2, sample_rate_hz=TIMED_RATE_HZ)
        began = time.process_time()
        diagnose(case.recordings, case.hold_out)
        spent.append(time.process_time() - began)
    return spent[1:]


@pytest.fixture(scope="session")
def found(rows: list[Row], cpu_s: list[float], findings: Findings, request: pytest.FixtureRequest) -> dict[str, Figure]:
    """The figures by name, tables and rows written where ``--bank-out`` says."""
    findings.figures = figures(rows, cpu_s)
    out = request.config.getoption("--bank-out")
    if out is not None:
        folder = Path(out)
        folder.mkdir(parents=True, exist_ok=True)
        write(rows, folder / "rows.jsonl")
        (folder / "bank.md").write_text(markdown(findings), encoding="utf-8")
        findings.written = [folder / "rows.jsonl", folder / "bank.md", *draw_confusion(rows, folder)]
    return {figure.name.strip(): figure for figure in findings.figures if figure.floor is not None}


FLOORS = (
    "one effect, 0.3 % or more: exact name",
    "one effect, 0.3 % or more: family",
    "two effects: the exact set",
    "a name given on data without an effect",
    "outside the catalogue: given no name",
    "calibration error of the confidence",
    "explainable held-out variance removed, mean",
    "smallest strength named right (family, 95 %)",
    "one diagnosis of 73,000 samples, one core, median",
)


@pytest.mark.parametrize("name", FLOORS)
def test_floor(found, name):
    figure = found[name]
    if not figure.count:
        pytest.skip("this bank has no such case")
    assert figure.met, f"{name}: {figure.value:.3g} {figure.unit} of {figure.count}, asked for {figure.floor:g}"


def test_every_floor_is_tested(found):
    assert set(found) == set(FLOORS)


def test_no_diagnosis_raises(rows):
    failed = failures(rows)
    assert not failed, f"{len(failed)} raised, the first, {failed[0].label}:\n{failed[0].error}"


def test_held_out_errors_fall_where_an_effect_is_named(rows):
    gains = [row.score.gain_percent for row in rows if row.score and row.kind in ("single", "grid") and row.score.named]
    if not gains:
        pytest.skip("this bank names nothing")
    assert statistics.median(gains) > 0
