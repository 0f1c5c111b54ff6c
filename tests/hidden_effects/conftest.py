"""Options of the bank (`test_bank`)."""

from __future__ import annotations

import os

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--bank-cases", type=int, default=20, help="cases of each kind in each world (default: 20)")
    parser.addoption("--bank-from", type=int, default=0, help="index of the first case of each kind (default: 0)")
    parser.addoption("--bank-kinds", default="single,two,three,none,outside,worlds", help="kinds to run, with commas")
    parser.addoption("--bank-rows", default=None, help="append every row to this file, and go on from what is there")
    parser.addoption("--bank-workers", type=int, default=2, help="processes (default: 2)")
    parser.addoption(
        "--second-lab", default=os.environ.get("SMARTSHOE_SECOND_LAB"), help="folder of a second laboratory's lab.py"
    )
