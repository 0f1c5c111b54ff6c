"""The same work by two commits, side by side: processor time, and whether their figures are the same.

    python tests/benchmarks/side_by_side.py                 # the checkout alone: each time over its yardstick's
    python tests/benchmarks/side_by_side.py dbba461         # that commit, this one and their ratio
    python tests/benchmarks/side_by_side.py dbba461 HEAD    # two commits

The work is asked for by the verbs of the package alone, so that a commit of other modules answers too. Each round is a
process of its own, the commits take turns, and the quickest round counts. The yardstick, one `scipy.signal.lfilter`
over the same samples, tells how busy the machine was.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cases
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.signal import lfilter

HERE = Path(__file__).resolve()
ROOT = HERE.parents[2]
ROUNDS = 3
LEAST_S = 0.3  # of processor time for which a task is repeated within a round
SAME = 1e-9  # relative: below, two figures differ by the order of sums alone
STEP_HZ, WALK_S, GAIT_HZ = 0.9, 60.0, 200.0
YARDSTICK = "yardstick: lfilter"


# -- the work --------------------------------------------------------------------------------------------------------
def walk() -> Any:
    """A minute's walk on eight units in N: half sines, one foot after the other, with noise of 1 N."""
    import smartshoe

    time_s = np.arange(0.0, WALK_S, 1.0 / GAIT_HZ)
    rng, units = np.random.default_rng(1), {}
    for foot, late in (("left", 0.0), ("right", 0.5)):
        phase = np.mod(STEP_HZ * time_s + late, 1.0) / 0.62
        for number, region in enumerate(("heel", "meta4", "meta1", "toe")):
            load = np.sin(np.pi * np.clip((phase - 0.12 * number) / 0.6, 0.0, 1.0))
            units[f"{foot}_{region}_n"] = 250.0 * load + rng.standard_normal(time_s.size)
    return smartshoe.Recording.from_arrays(time_s=time_s, name="walk", **units)


def tasks() -> dict[str, tuple[Callable[[], Any], Callable[[Any], list[float]]]]:
    """By name: what is done, and the figures of its result."""
    import smartshoe

    shoe, rng = cases.shoe(), np.random.default_rng(0)
    force_n = shoe.load_n + cases.LOAD_NOISE_N * rng.standard_normal(shoe.load_n.size)
    recording = smartshoe.Recording.from_arrays(
        time_s=shoe.time_s, force_n=force_n, pressure_mbar=shoe.reading, name="triangles", unit="left_toe"
    )
    known: dict[str, Any] = {"offset": 0.0, "delay": 0.0, "initial_state": "steady"}
    found = smartshoe.identify([recording], **known)
    calibration = found.calibration()
    linear = cases.rao_garnier()
    response = linear.noisy(0.1, np.random.default_rng(0))
    bank = smartshoe.stack([found.compensator(sample_rate_hz=100.0) for _ in range(8)])
    readings = np.repeat(shoe.reading[:, None], 8, axis=1)
    trial = walk()

    def coefficients(fit: Any) -> list[float]:
        return [fit.parameters[name].value for name in ("a1", "b0", "b1")]

    return {
        YARDSTICK: (lambda: lfilter([1.0, 0.5], [1.0, -0.5], shoe.reading), lambda y: [float(y[-1])]),
        "identify, nuisances known": (lambda: smartshoe.identify([recording], **known), coefficients),
        "identify, defaults": (lambda: smartshoe.identify([recording]), coefficients),
        "transfer function, order 4": (
            lambda: smartshoe.identify_transfer_function(
                linear.u, response, sample_time_s=linear.sample_time_s, poles=4, zeros=1
            ),
            lambda fit: [*map(float, fit.numerator), *map(float, fit.denominator)],
        ),
        "bank of eight, a block": (lambda: bank.push(readings), lambda force: [float(np.sum(force))]),
        "validate": (
            lambda: smartshoe.validate([recording], calibration),
            lambda said: [rate.rmse_compensated_n for rate in said.rates],
        ),
        "diagnose, 19,401 samples": (
            lambda: smartshoe.diagnose([recording]),
            lambda said: [float(len(said.to_dict()["causes"]))],
        ),
        "gait, a minute": (
            lambda: __import__("smartshoe.gait").gait.analyse([trial], body_weight_n=700.0),
            lambda said: [event["time_s"] for event in said.to_dict()["events"]],
        ),
    }


def run_round() -> dict[str, dict[str, Any]]:
    """Processor seconds a call, and the figures, of each task that this tree can do."""
    done: dict[str, dict[str, Any]] = {}
    for name, (work, figures) in tasks().items():
        result = work()  # compiles what is compiled
        calls, started = 0, time.process_time()
        while calls == 0 or time.process_time() - started < LEAST_S:
            work()
            calls += 1
        done[name] = {"s": (time.process_time() - started) / calls, "figures": figures(result)}
    return done


# -- two commits -----------------------------------------------------------------------------------------------------
def tree_of(revision: str | None, folder: Path) -> Path:
    """The checkout itself, or a copy of what ``revision`` holds."""
    if revision is None:
        return ROOT
    packed = subprocess.run(
        ["git", "-C", str(ROOT), "archive", revision, "smartshoe", "simulators"], check=True, capture_output=True
    ).stdout
    into = folder / revision.replace("/", "_")
    with tarfile.open(fileobj=io.BytesIO(packed)) as files:
        files.extractall(into, filter="data")
    return into


def round_in(tree: Path) -> dict[str, dict[str, Any]]:
    """`run_round` in a process that imports the packages of ``tree``, on one thread."""
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        [sys.executable, str(HERE), "--round"], env=os.environ | one_thread | {"PYTHONPATH": str(tree)},
        cwd=tree, check=True, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    found: dict[str, dict[str, Any]] = json.loads(done.stdout)
    return found


def difference(one: list[float], other: list[float]) -> str:
    """How far apart the figures of two commits are."""
    if len(one) != len(other):
        return f"{len(one)} and {len(other)} figures"
    furthest = max(
        (abs(a - b) / max(abs(a), abs(b), 1e-300) for a, b in zip(one, other, strict=True) if a != b), default=0.0
    )
    return (
        "the same" if furthest == 0.0 else f"the same to {furthest:.0e}" if furthest < SAME else f"{furthest:.1e} apart"
    )


def compared(revisions: list[str | None], rounds: int) -> Table:
    """A row a task; a column a commit, then their ratio and whether their figures are the same."""
    with tempfile.TemporaryDirectory() as folder:
        trees = [tree_of(revision, Path(folder)) for revision in revisions]
        done = [[round_in(tree) for tree in trees] for _ in range(rounds)]
    names = [revision or "this checkout" for revision in revisions]
    table = Table("processor time a call", *names, *(["ratio", "figures"] if len(names) == 2 else ["in yardsticks"]))
    least = {name: [min(each[k][name]["s"] for each in done) for k in range(len(names))] for name in done[0][0]}
    for name, taken in least.items():
        times = [f"{1e3 * each:.3f} ms" for each in taken]
        if len(names) == 2:
            figures = difference(*(done[0][k][name]["figures"] for k in range(2)))
            table.add_row(name, *times, f"{taken[1] / taken[0]:.2f}", figures)
        else:
            table.add_row(name, *times, f"{taken[0] / least[YARDSTICK][0]:.1f}")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("revisions", nargs="*", help="none: the checkout alone; one: that commit and the checkout")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--round", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.round:
        json.dump(run_round(), sys.stdout)
        return
    revisions = [*options.revisions, None][:2] if options.revisions else [None]
    Console(width=120).print(compared(revisions, options.rounds))


if __name__ == "__main__":
    main()
