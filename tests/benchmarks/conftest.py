"""The table of figures, printed at the end of the session and written where ``--markdown`` says."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from table import FigureTable

TABLE = pytest.StashKey[FigureTable]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--markdown", default=None, help="file to which the table of figures is written as well")
    parser.addoption("--events-page", default=None, help="file to which the comparison of gait events is written")
    parser.addoption(
        "--peers-python", default=sys.executable, help="interpreter in which the extra 'peers' is installed"
    )


def pytest_configure(config: pytest.Config) -> None:
    config.stash[TABLE] = FigureTable()


@pytest.fixture(scope="session")
def table(request: pytest.FixtureRequest) -> FigureTable:
    """Rows go here."""
    return request.config.stash[TABLE]


def pytest_terminal_summary(config: pytest.Config) -> None:
    found = config.stash[TABLE]
    if not found.rows:
        return
    found.show()
    markdown = config.getoption("--markdown", default=None)
    if markdown is not None:
        found.write(Path(markdown))
