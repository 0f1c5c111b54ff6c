"""One trial and one calibration through each format, out and in again: rows of the table in docs/export.md."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from c_code import run_filters

import smartshoe
from simulators.people import Person, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.calibration.export import export_files, write_files
from smartshoe.gait import GaitResult, analyse, write_c3d
from smartshoe.gait._c3d import LABELS, analog_signals
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

TABLES = {
    ".csv": "plain table",
    ".h5": "HDF5",
    ".mat": "MATLAB",
    ".parquet": "Parquet",
    ".tdms": "NI TDMS",
    ".lvm": "LabVIEW",
}
HEADER = (
    "| format | samples | time | units | missing samples | the device's times | metadata | events |",
    "| --- " * 8 + "|",
)


@lru_cache
def walked() -> Recording:
    """Eight units through bladder, sensor and 12 bits for 8 s, the shoe's own clock beside, two samples lost."""
    made = trial(Person(), Walk(1.3), 8.0, np.random.default_rng(5)).recording
    columns = {f"{channel.name}_mbar": channel.values.copy() for channel in made.sensors}
    columns["left_heel_mbar"][700:702] = np.nan
    # A clock of its own: 40 ppm fast, begun 12.3 s earlier.
    device_s = 12.3 + made.time_s * (1.0 + 40e-6)
    return Recording.from_arrays(
        time_s=made.time_s, name="walk", unit=None, metadata={"subject": "Änna"}, device_time_s=device_s, **columns
    )


def table_row(suffix: str, folder: Path) -> str:
    """The row of a format that holds a recording."""
    given = walked()
    smartshoe.write(given, folder / f"walk{suffix}")
    found = smartshoe.read(folder / f"walk{suffix}")
    device = [channel for channel in found.channels.values() if channel.name.startswith("device_time")]
    cells = [
        _apart(given, found, [channel.name for channel in given.sensors]),
        _the_same(float(np.abs(found.time_s - given.time_s).max()), "s"),
        _yes(all(found[c.name].unit == c.unit for c in given.sensors)),
        _yes(all(np.array_equal(found[c.name].present, c.present) for c in given.sensors)),
        _yes(len(device) == 1)
        if not device
        else _the_same(_furthest(device[0].values, given["device_time"].values), "s"),
        _yes(found.name == given.name and found.metadata.get("subject") == "Änna"),
        _events(analysed(), analyse([found])),
    ]
    return f"| {TABLES[suffix]} (`{suffix}`) | {' | '.join(cells)} |"


@lru_cache
def analysed() -> GaitResult:
    """What `walked` tells."""
    return analyse([walked()])


def _apart(given: Recording, found: Recording, names: list[str]) -> str:
    return _the_same(max(_furthest(found[name].with_nan(), given[name].with_nan()) for name in names), "mbar")


def _loads_apart(given: GaitResult, found: Any) -> str:
    """The loads that the trial's analysis tells, zero taken off, by name in ``found``."""
    loads = {signal.label: signal.values for signal in analog_signals(given)[1] if signal.unit == "mbar"}
    return _the_same(max(_furthest(np.asarray(found[name]), loads[name]) for name in loads), "mbar")


def _furthest(found: np.ndarray, given: np.ndarray) -> float:
    assert np.array_equal(np.isnan(found), np.isnan(given))
    return float(np.nanmax(np.abs(found - given)))


def _the_same(apart: float, unit: str) -> str:
    return "the same" if apart == 0.0 else f"within {10.0 ** np.ceil(np.log10(apart)):.0e} {unit}"


def _yes(kept: bool) -> str:
    return "the same" if kept else "lost"


def _events(given: GaitResult, found: GaitResult) -> str:
    assert given.events
    if [(e.foot, e.event) for e in given.events] != [(e.foot, e.event) for e in found.events]:
        return "others"
    pairs = zip(given.events, found.events, strict=True)
    return _the_same(max(abs(one.time_s - other.time_s) for one, other in pairs), "s")


def calibration() -> Calibration:
    """The paper's left toe."""
    return Calibration(0.215, 1.593, 0.3249, MILLIBAR, offset=1.5, unit="left_toe", load_range_n=(0.0, 800.0))


def c3d_row(folder: Path) -> str:
    """C3D, opened again by ezc3d."""
    import ezc3d

    given = walked()
    told = analysed()
    write_c3d(folder / "walk.c3d", told)
    opened = ezc3d.c3d(str(folder / "walk.c3d"))
    analog, event = opened["parameters"]["ANALOG"], opened["parameters"]["EVENT"]
    names = analog["LABELS"]["value"]
    values = dict(zip(names, opened["data"]["analogs"][0], strict=True))
    units = dict(zip(names, analog["UNITS"]["value"], strict=True))
    time_s = np.arange(len(given)) / analog["RATE"]["value"][0] + opened["parameters"]["TRIAL"]["START_S"]["value"][0]
    minutes, seconds = event["TIMES"]["value"]
    named = [
        (context, label) for context, label in zip(event["CONTEXTS"]["value"], event["LABELS"]["value"], strict=True)
    ]
    assert named == [(e.foot.capitalize(), LABELS[e.event]) for e in told.events]
    cells = [
        _loads_apart(told, values),
        _the_same(float(np.abs(time_s - given.time_s).max()), "s"),
        _yes(all(units[c.name] == c.unit.symbol for c in given.sensors)),
        "held at the last", "not carried", "not carried",
        _the_same(_furthest(60.0 * minutes + seconds, np.array([e.time_s for e in told.events])), "s"),
    ]  # fmt: skip
    return f"| C3D (`.c3d`, by ezc3d) | {' | '.join(cells)} |"


def motion_bids_row(folder: Path) -> str:
    """A Motion-BIDS folder, its tables read as tables."""
    import pandas as pd

    from smartshoe.gait import write_motion_bids

    given = walked()
    told = analysed()
    paths = {path.name.split("_")[-1]: path for path in write_motion_bids(folder / "set", told, subject="Anna")}
    about = pd.read_csv(paths["channels.tsv"], sep="\t", na_values="n/a")
    found = pd.read_csv(paths["motion.tsv"], sep="\t", names=about["name"], na_values="n/a")
    events = pd.read_csv(paths["events.tsv"], sep="\t")
    units = dict(zip(about["name"], about["units"], strict=True))
    assert list(events["trial_type"]) == [f"{e.foot}_{e.event}" for e in told.events]
    cells = [
        _loads_apart(told, found),
        _the_same(float(np.abs(found["time"] - given.time_s).max()), "s"),
        _yes(all(units[c.name] == c.unit.symbol for c in given.sensors)),
        "held at the last", "not carried", "not carried",
        _the_same(_furthest(events["onset"].to_numpy(), np.array([e.time_s for e in told.events])), "s"),
    ]  # fmt: skip
    return f"| Motion-BIDS (a folder) | {' | '.join(cells)} |"


CALIBRATION_HEADER = (
    "| format | a1, b0, b1, offset | unit and loads | the force of a walk's readings |",
    "| --- " * 4 + "|",
)


def calibration_row(folder: Path) -> str:
    """The calibration's own file."""
    calibration().save(folder / "toe.json")
    found = Calibration.load(folder / "toe.json")
    return _calibration_row("calibration file (`.json`)", found)


def numbers_row(folder: Path) -> str:
    """``export --to json``, from which a calibration is made again."""
    files = export_files(calibration(), "json", sample_rate_hz=200.0)
    told = json.loads(next(iter(files.values())))
    a1, b0, b1 = (told["continuous"][name] for name in ("a1", "b0", "b1"))
    loads = tuple(told["load_range_n"])
    found = Calibration(a1, b0, b1, MILLIBAR, offset=told["offset"], unit=told["unit"], load_range_n=loads)
    return _calibration_row("numbers (`--to json`)", found)


def c_row(folder: Path) -> str:
    """``export --to c``, compiled: the filter alone comes back."""
    write_files(export_files(calibration(), "c", sample_rate_hz=200.0, name="toe"), folder)
    readings = walked()["left_toe"].values
    forces = run_filters(folder, {"toe": readings})["toe"]
    expected = calibration().compensator(200.0).apply(readings)
    # To the last bit where the machine does not fuse multiplication and addition.
    near = _furthest(forces, expected) < 1e-12 * float(np.abs(expected).max())
    return f"| C, double (`--to c`) | as coefficients of z | in the header | {'to rounding' if near else 'another'} |"


def _calibration_row(name: str, found: Calibration) -> str:
    given, readings = calibration(), walked()["left_toe"].values
    same = [getattr(found, key) == getattr(given, key) for key in ("a1", "b0", "b1", "offset")]
    told = [getattr(found, key) == getattr(given, key) for key in ("unit", "reading_unit", "load_range_n")]
    forces = (one.compensator(200.0).apply(readings) for one in (found, given))
    return f"| {name} | {_yes(all(same))} | {_yes(all(told))} | {_the_same(_furthest(*forces), 'N')} |"
