"""Options of the bank, and its tables at the session's end."""

from __future__ import annotations

import pytest
from bank_report import Findings, markdown

FINDINGS = pytest.StashKey[Findings]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--bank-cases", type=int, default=100, help="cases in each set of the bank (default: 100)")
    parser.addoption("--bank-from", type=int, default=0, help="index of the first case in each set (default: 0)")
    parser.addoption("--bank-sets", default="grid,single,pair,none,outside", help="sets to run, with commas")
    parser.addoption("--bank-out", default=None, help="folder for rows.jsonl, bank.md and the confusion matrix")
    parser.addoption("--bank-rows", default=None, help="judge the rows of this file instead of running anything")
    parser.addoption("--bank-workers", type=int, default=2, help="processes (default: 2)")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[FINDINGS] = Findings()


@pytest.fixture(scope="session")
def findings(request: pytest.FixtureRequest) -> Findings:
    """Where the bank's tests put what they found."""
    return request.config.stash[FINDINGS]


def pytest_terminal_summary(config: pytest.Config) -> None:
    found = config.stash[FINDINGS]
    if found.rows:
        print(markdown(found))
        for path in found.written:
            print(f"written: {path}")
