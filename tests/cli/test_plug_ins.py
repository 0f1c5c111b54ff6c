"""Effects of other packages, as the command line tells of those that fail, are broken, or are not installed."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration
from smartshoe.cli import run_command
from smartshoe.models.effects import (
    Conditions,
    Effect,
    EffectParameter,
    Inverse,
    Memoryless,
    by,
    effect,
    failure_of_others,
)
from smartshoe.units import MILLIBAR

PLAIN = Calibration(a1=0.2, b0=3.6, b1=0.85, reading_unit=MILLIBAR, unit="left_toe")


def _fails_below_zero(signal: Array, time_s: Array) -> Array:
    if np.min(signal) < 0.0:  # as no signal is that an effect is tried on
        raise KeyError("table")
    return signal


class Odd(Effect):
    """An effect that fails, as its inverse does, on what it is not tried on."""

    name, family, stage, place = "odd_one", "odd", "sensor", "sensor"
    says = "the odd thing happens"
    parameters = (EffectParameter("amount", "1", "how much", 0.0, -0.5, 0.5, 0.01),)
    exposed_by = by("rates")

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        return _fails_below_zero(signal, conditions.time_s) * (1.0 + values[0])

    def inverse(self, values: Array, step_s: float) -> Inverse:
        return Memoryless(_fails_below_zero, "x = x;")


class Broken(Odd):
    """One that fails when it is offered."""

    name = "broken_one"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        raise KeyError("gauge")


@pytest.fixture
def calibration(tmp_path: Path, installed: ModuleType) -> Path:
    """A calibration of a unit with an effect of another package, which is installed."""
    installed.Odd = Odd  # type: ignore[attr-defined]
    path = tmp_path / "c.json"
    replace(PLAIN, extended=PLAIN.model().with_part(effect("odd_one"), [0.1])).save(path)
    return path


def test_an_effect_that_fails_in_a_compensator_is_named(
    calibration: Path, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "o.csv"
    assert run_command(["compensate", str(table), "--calibration", str(calibration), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "error: effect 'odd_one' fails (KeyError: 'table'): mend or uninstall the package" in said
    assert "smartshoe itself" not in said
    assert not out.exists()


def test_an_effect_that_fails_in_a_diagnosis_is_named(
    installed: ModuleType, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    installed.Odd = Odd  # type: ignore[attr-defined]
    assert run_command(["diagnose", str(table), "--out", str(tmp_path / "o")]) == 2
    assert "error: effect 'odd_one' fails (KeyError: 'table'): mend or uninstall" in capsys.readouterr().err


def test_what_is_no_fault_of_an_installed_effect_is_not_put_down_to_it(installed: ModuleType) -> None:
    installed.Odd = Odd  # type: ignore[attr-defined]
    assert effect("odd_one").name == "odd_one"
    elsewhere: dict[str, object] = {"__name__": "smartshoe.elsewhere", "__builtins__": __builtins__}
    exec("def ours(odd): raise KeyError('ours')\ndef theirs(self): raise KeyError('theirs')", elsewhere)

    def said(name: str) -> str:
        with pytest.raises(KeyError) as caught:
            elsewhere[name](effect("odd_one"))  # type: ignore[operator]
        trace = caught.value.__traceback__
        return failure_of_others(caught.value.with_traceback(trace.tb_next if trace else None))  # without this file

    assert said("ours") == ""
    assert said("theirs").startswith("effect 'odd_one' fails (KeyError: 'theirs')")


@pytest.mark.parametrize("key", ["extended", "twin"])
@pytest.mark.parametrize("is_broken", [False, True])
def test_a_calibration_with_an_effect_that_is_not_there_asks_for_its_package(
    key: str,
    is_broken: bool,
    installed: ModuleType,
    forget_effects: Callable[[], None],
    table: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    installed.Odd = Odd  # type: ignore[attr-defined]
    path = tmp_path / "c.json"
    model = PLAIN.model()
    known = {"extended": model, "twin": model} | {key: model.with_part(effect("odd_one"), [0.1])}
    replace(PLAIN, **known).save(path)  # type: ignore[arg-type]
    del installed.Odd
    if is_broken:
        installed.Odd = Broken  # type: ignore[attr-defined]
    forget_effects()
    assert run_command(["compensate", str(table), "--calibration", str(path), "--out", str(tmp_path / "o.csv")]) == 3
    said = capsys.readouterr().err
    why = r"effect 'Odd' fails \(KeyError: 'gauge'\): .*" if is_broken else "no package that is installed offers it"
    assert re.search(
        rf"c\.json: key '{key}\.effects\.odd_one' is of an effect that is not known here \({why}\): install or mend the"
        " package that offers it",
        said,
    )
    assert "identify" not in said


def test_a_broken_package_is_in_the_way_of_no_calibration_without_its_effects(
    installed: ModuleType, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    installed.Broken = Broken  # type: ignore[attr-defined]
    path, words = tmp_path / "c.json", ["--calibration", str(tmp_path / "c.json")]
    model = PLAIN.model().with_part("linear_leak", [0.01]).with_part("flexible_loop")
    replace(PLAIN, extended=model, twin=model).save(path)
    for command in (
        ["compensate", str(table), *words, "--out", str(tmp_path / "o.csv")],
        ["validate", str(table), *words],
        ["export", str(path), "--to", "json", "--out", str(tmp_path / "x")],
    ):
        assert run_command(command) == 0, capsys.readouterr().err
    assert run_command(["diagnose", str(table), "--out", str(tmp_path / "d")]) == 2
    assert "error: effect 'Broken' fails (KeyError: 'gauge'): mend or uninstall" in capsys.readouterr().err
