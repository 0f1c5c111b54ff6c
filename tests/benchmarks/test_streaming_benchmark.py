"""A bank of eight beside numpy's addition (ticks) and SciPy's lfilter (blocks): ratios, which are asserted."""

from __future__ import annotations

import time
import timeit
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from table import FigureTable

from smartshoe.calibration import Compensator, stack

pytestmark = pytest.mark.benchmark
UNITS, ROUNDS = 8, 15
CASE = "streaming, 8 units a tick"


def quickest_ns(rivals: dict[str, str], names: dict[str, Any], calls: int) -> dict[str, float]:
    """ns of processor time that each statement takes in the quickest of the rounds, in which the rivals take turns."""
    timers = {
        rival: timeit.Timer(statement, timer=time.process_time, globals=names) for rival, statement in rivals.items()
    }
    rounds = [{rival: timer.timeit(calls) for rival, timer in timers.items()} for _ in range(ROUNDS)]
    return {rival: 1e9 * min(each[rival] for each in rounds) / calls for rival in rivals}


def a_bank() -> Any:
    return stack([Compensator(0.1 * (n + 1), 1.593, 0.3249, offset=n) for n in range(UNITS)])


def test_a_tick(table: FigureTable) -> None:
    names = {"bank": a_bank(), "a": np.ones(UNITS), "b": np.ones(UNITS), "out": np.empty(UNITS)}
    rivals = {"add": "a + b", "out": "bank.push(a, out)", "new": "bank.push(a)"}
    found = quickest_ns(rivals, names, 20_000)
    ratio = found["out"] / found["add"]
    peer = f"a + b: {found['add']:.0f} ns"
    table.add(CASE, "a tick with out", f"{ratio:.2f} ({found['out']:.0f} ns)", asked="1.5", peer=peer, met=ratio <= 1.5)
    table.add(CASE, "a tick, new array", f"{found['new'] / found['add']:.2f} ({found['new']:.0f} ns)", peer=peer)
    assert ratio <= 1.5


@pytest.mark.parametrize("ticks", [100, 1000, 20_000])
def test_a_block(table: FigureTable, ticks: int) -> None:
    bank = a_bank()
    block = np.random.default_rng(0).standard_normal((ticks, UNITS)).cumsum(axis=0)
    n, d = bank.filters[0].numerator, bank.filters[0].denominator
    names = {"bank": bank, "block": block, "out": np.empty_like(block), "lfilter": lfilter, "n": n, "d": d}
    rivals = {"bank": "bank.push(block, out)", "lfilter": "lfilter(n, d, one)"}
    found = quickest_ns(rivals, names | {"one": block[:, 0].copy()}, 20)
    bank_ns, lfilter_ns = found["bank"] / block.size, found["lfilter"] / ticks
    ratio = bank_ns / lfilter_ns
    table.add(
        CASE, f"per sample, block of {ticks}", f"{ratio:.2f} ({bank_ns:.2f} ns)",
        asked="0.7", peer=f"lfilter: {lfilter_ns:.2f} ns", met=ratio <= 0.7,
    )  # fmt: skip
    assert ratio <= 0.7
