"""A shoe's filters in one program: names, overwriting, what a header says, and every arithmetic against Python."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from c_code import ARM, CORES, compiled, macro, needs_arm, needs_compiler, run_filters

from smartshoe.calibration import Calibration
from smartshoe.calibration.export import export_files, export_shoe, write_files
from smartshoe.errors import UsageError
from smartshoe.units import MILLIBAR

SAMPLES = 20_000
X = 0.38113
TABLE_1 = {  # k1 and k2 of Chinimilli 2016, Table 1
    "right_toe": (1.873, 0.119), "right_heel": (2.045, 0.159), "left_toe": (1.341, 0.215), "left_heel": (2.025, 0.316)
}  # fmt: skip
SHOE = [
    Calibration(
        k2, 1.0 + (k1 + k2) * X, k2 * (1.0 + k1 * X), MILLIBAR, offset=1.5, unit=unit, load_range_n=(-1.0, 800.0),
        rate_range_n_per_s=(50.0, 800.0), created="2026-10-01",
        sources=({"name": f"{unit}_dynamic.csv", "sha256": "0123abcd"},),
    )
    for unit, (k1, k2) in TABLE_1.items()
]  # fmt: skip
NAMES = list(TABLE_1)
ARITHMETIC = {"double": {}, "float": {"precision": "float"}, "q31": {"fixed": "q31"}, "q15": {"fixed": "q15"}}
BOUNDS_N = {"double": 1e-9, "float": 3e-4, "q31": 1e-3, "q15": 0.07}


def _readings(calibration: Calibration) -> np.ndarray:
    """Steps, holds and ramps over the calibrated loads, with noise."""
    rng = np.random.default_rng(7)
    levels = np.repeat(rng.uniform(0.0, 800.0, 200), 2)
    at = np.interp(np.arange(SAMPLES), np.sort(rng.uniform(0, SAMPLES, levels.size)), levels)
    return 1.5 + (at + rng.normal(0.0, 0.5, SAMPLES)) * calibration.a1 / calibration.b1


@needs_compiler
@pytest.mark.parametrize("arithmetic", ARITHMETIC)
def test_four_units_in_one_program_give_pythons_forces(arithmetic: str, tmp_path: Path) -> None:
    write_files(export_shoe(SHOE, "c", **ARITHMETIC[arithmetic]), tmp_path)
    is_fixed, bound_n = "fixed" in ARITHMETIC[arithmetic], BOUNDS_N[arithmetic]
    given = _readings(SHOE[0])
    if arithmetic == "float":
        given = given.astype(np.float32).astype(float)
    put, got = (dict.fromkeys(NAMES, 1.0) for _ in range(2))
    if is_fixed:
        put, got = ({name: macro(tmp_path, f"{name}_{way}_LSB") for name in NAMES} for way in ("INPUT", "OUTPUT"))
    forces = run_filters(tmp_path, {name: np.rint(given / put[name]) if is_fixed else given for name in NAMES})
    for calibration in SHOE:
        name = calibration.unit
        expected_n = calibration.compensator().apply(given)
        worst_n = np.max(np.abs(got[name] * forces[name] - expected_n))
        assert worst_n <= (1e-12 * np.max(np.abs(expected_n)) if arithmetic == "double" else bound_n)
        if is_fixed:
            stated_n = macro(tmp_path, f"{name}_ERROR_BOUND_N")
            assert worst_n <= stated_n <= bound_n
            assert macro(tmp_path, f"{name.upper()}_ERROR_BOUND_N") == stated_n


@needs_arm
@pytest.mark.parametrize("core", CORES)
def test_firmware_compilers_take_every_arithmetic_and_the_tables_fit(core: str, tmp_path: Path) -> None:
    assert ARM is not None
    for label, options in ARITHMETIC.items():
        folder = tmp_path / label
        write_files(export_files(SHOE[0], "c", **options), folder)
        out = compiled([folder / "smartshoe_filter.c"], folder / "filter.o", *CORES[core], "-Os", "-c", compiler=ARM)
        text = subprocess.run([ARM.replace("gcc", "size"), str(out)], capture_output=True, text=True, check=True).stdout
        code, data, zeroed = (int(word) for word in text.splitlines()[1].split()[:3])
        print(f"{core} {label}: {code} bytes of flash, {data + zeroed} bytes of RAM")
        assert data + zeroed == 0  # all state is the caller's
        assert code < 1024


@needs_compiler
@pytest.mark.parametrize("options", [{}, {"precision": "float"}, {"fixed": "q15"}], ids=str)
def test_the_header_says_the_size_that_the_compiler_gives(options: dict[str, str], tmp_path: Path) -> None:
    write_files(export_files(SHOE[0], "c", **options), tmp_path)
    said = re.search(r"memory: (\d+) bytes of state", (tmp_path / "smartshoe_filter.h").read_text())
    assert said is not None
    (tmp_path / "size.c").write_text(
        '#include "smartshoe_filter.h"\n#include <stdio.h>\n'
        'int main(void)\n{\n    printf("%lu\\n", (unsigned long)sizeof(smartshoe_filter));\n    return 0;\n}\n'
    )
    program = compiled([tmp_path / "size.c"], tmp_path / "size")
    assert subprocess.run([program], capture_output=True, text=True, check=True).stdout == f"{said[1]}\n"


def test_the_header_says_where_it_comes_from_and_what_it_costs() -> None:
    header = export_shoe(SHOE, "c")["left_toe.h"]
    for said in (
        "unit: left_toe", "calibrated: 2026-10-01", "calibrated load: -1 to 800 N", "loading rates: 50 to 800 N/s",
        "source 1: left_toe_dynamic.csv, sha256 0123abcd", "at most 3 additions, 4 multiplications\n",
    ):  # fmt: skip
        assert said in header


def test_several_units_are_named_by_unit_and_one_as_ever() -> None:
    assert {"smartshoe_filter.h", "smartshoe_filter.c"} < set(export_shoe(SHOE[:1], "c"))
    several = set(export_shoe(SHOE, "c"))
    assert {f"{name}.{end}" for name in NAMES for end in "ch"} == {path for path in several if "/" not in path}
    assert {"toe.c", "heel.c"} < set(export_shoe(SHOE[:2], "c", names=["toe", "heel"]))
    assert {"anna_right_toe.c", "anna_right_heel.c"} < set(export_shoe(SHOE[:2], "c", names=["anna"]))
    assert set(export_shoe(SHOE, "json")) == {f"{name}.json" for name in NAMES}
    assert "function force = left_toe(reading)" in export_shoe(SHOE, "matlab")["left_toe.m"]


def test_a_units_name_becomes_an_identifier() -> None:
    named = [Calibration(**{**vars(SHOE[0]), "unit": unit}) for unit in ("left toe/2", "3rd")]
    assert {"left_toe_2.c", "unit_3rd.c"} < set(export_shoe(named, "c"))


@pytest.mark.parametrize(
    ("units", "names", "says"),
    [
        (["left_toe"], ["left toe"], "no name in C"),
        (["left_toe"], ["double"], "taken"),
        (["left_toe"], ["math"], "taken"),
        (["left_toe"], ["a" * 64], "63"),
        (["left_toe", "left toe"], [], "both called 'left_toe'"),
        (["left_toe", "Left_Toe"], [], "both called"),
        (["left_toe", ""], [], "no unit name"),
        (["a", "a_test"], [], "self-test"),
        (["a", "b", "c"], ["x", "y"], "2 times for 3"),
    ],
)
def test_names_that_cannot_be_are_refused(units: list[str], names: list[str], says: str) -> None:
    calibrations = [Calibration(**{**vars(SHOE[0]), "unit": unit}) for unit in units]
    with pytest.raises(UsageError, match=says):
        export_shoe(calibrations, "c", names=names)


def test_nothing_is_overwritten_without_being_told(tmp_path: Path) -> None:
    write_files({"a.c": "1", "b.c": "1"}, tmp_path)
    with pytest.raises(UsageError, match=r"b\.c would be overwritten.*--force"):
        write_files({"b.c": "2", "c.c": "2"}, tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.c": "1", "b.c": "1"}
    write_files({"b.c": "2", "c.c": "2"}, tmp_path, force=True)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.c": "1", "b.c": "2", "c.c": "2"}
