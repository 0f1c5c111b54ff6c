"""Every command that writes, with what it reads: for the tests that kill it, fill its disk and take its rights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simulators.people import Person, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore
from smartshoe.devices import open_shoe
from smartshoe.files.logs import write
from smartshoe.units import MILLIBAR

OLD = b"as it was"
SCENARIO = """\
title = "small"
seed = 3
[machine]
backend = "sim:instron"
[protocol.dynamic]
rates_n_per_s = [400.0, 800.0]
[[unit]]
name = "left_toe"
"""
SWEEP = '[sweep]\nseeds = [0, 1]\n[sweep.vary]\n"unit.left_toe.bladder.k1" = [1.2, 1.5]\n'
STUDY = 'title = "two"\n' + "".join(
    f'[[trial]]\nfile = "G.csv"\nsubject = "Anna"\ncondition = "{condition}"\ncoverage = 0.8\n' for condition in ("a",)
)
PROTOCOL = '[protocol.short]\nkind = "dynamic"\nrates_n_per_s = [200, 800]\nrest_s = 2\n'


@dataclass(frozen=True, slots=True)
class Writing:
    """A command: ``words``, results that ``stood`` there before; ``again``, what ends its work after it was stopped.

    ``grows``: its file is appended to and never replaced, what is in it is a beginning of the whole.
    """

    words: str
    stood: tuple[str, ...] = ()
    again: str = ""
    grows: bool = False


_BENCH = "--shoe sim:stand?seed=5 --machine sim:instron?seed=6 --unit left_toe --no-diagnose --protocol P.toml"
_STREAM = "stream --shoe replay:W.csv --out"
WRITING: Mapping[str, Writing] = {
    **{
        f"convert {end}": Writing(f"convert T.csv o.{end}", (f"o.{end}",))
        for end in ("csv", "h5", "mat", "tdms", "lvm")
    },
    "convert parquet": Writing("convert T.csv o.parquet", ("o.parquet",)),
    "identify": Writing("identify T.csv --json o.json --calibration c.json", ("o.json", "c.json")),
    "compensate": Writing("compensate T.csv --calibration C.json --out o.csv", ("o.csv",)),
    "validate": Writing("validate T.csv --calibration C.json --json o.json", ("o.json",)),
    "diagnose": Writing("diagnose T.csv --out o --json d.json --calibration e.json", ("d.json", "e.json")),
    "export c": Writing("export C.json --to c --out o --force", ("o/smartshoe_filter.c", "o/smartshoe_filter.h")),
    "export matlab": Writing("export C.json --to matlab --out o --force"),
    "export json": Writing("export C.json --to json --out o --force"),
    "export fmu": Writing("export C.json --to fmu --out o --force"),
    "run": Writing("run S.toml --out o --json r.json", ("r.json",)),
    "simulate": Writing("simulate S.toml --out o"),
    "gait": Writing("gait G.csv --out o --json g.json --coverage 0.8", ("g.json",)),
    "calibrations add": Writing("calibrations add C.json --serial-number 8 --store s"),
    "calibrations swap": Writing("calibrations swap left_heel 7 --date 2026-02-01 --store s"),
    "calibrations drift": Writing("calibrations drift 7 --store s --out o --json d.json", ("d.json",)),
    "calibrate": Writing(f"calibrate {_BENCH} --out o", again="calibrate --resume o"),
    "sweep": Writing("sweep W.toml --out o --jobs 1"),
    "study": Writing("study Y.toml --out o --json y.json", ("y.json",)),
    "stream": Writing(
        "stream --shoe replay:W.csv --out o.csv", again="stream --shoe replay:W.csv --out p.csv", grows=True
    ),
}


def write_inputs(folder: Path) -> None:
    """What the commands read, in ``folder``."""
    time_s = np.arange(1500) * 0.02
    load_n = 100 * (1 - np.cos(1.3 * time_s)) + 40 * (1 - np.cos(3.1 * time_s))
    remembered_n = 0.02 * np.cumsum(load_n * np.exp(0.2 * (time_s - time_s[-1]))) * np.exp(0.2 * (time_s[-1] - time_s))
    readings = load_n / 8 + 0.02 * remembered_n + 0.02 * np.random.default_rng(1).standard_normal(time_s.size)
    rows = "".join(f"{t:.2f},{f:.3f},{p:.3f}\n" for t, f, p in zip(time_s, load_n, readings, strict=True))
    (folder / "T.csv").write_text("time_s,force_n,pressure_mbar\n" + rows)
    calibration = Calibration(0.2, 5.0, 1.0, MILLIBAR, unit="left_toe", created="2026-01-01")
    calibration.save(folder / "C.json")
    store = CalibrationStore(folder / "s")
    store.add(calibration, serial_number="7")
    store.add(Calibration(0.2, 5.1, 1.0, MILLIBAR, unit="left_toe", created="2026-01-09"), serial_number="7")
    (folder / "S.toml").write_text(SCENARIO)
    (folder / "W.toml").write_text(SCENARIO + SWEEP)
    (folder / "P.toml").write_text(PROTOCOL)
    (folder / "Y.toml").write_text(STUDY)
    walk = trial(Person(), Walk(1.2), 8.0, np.random.default_rng(7), sensors=False, noise_n=1.0, outside="even")
    write(walk.recording, folder / "G.csv")
    with open_shoe("sim:walk", duration_s=3.0) as shoe:
        write(shoe.record(), folder / "W.csv")
