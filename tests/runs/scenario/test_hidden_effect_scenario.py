"""The scenario that shows the heart of it: what was hidden is found, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from smartshoe.cli import run_command


def test_the_hidden_leak_and_warm_up_are_found_and_nothing_else(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["run", str(root / "scenarios" / "hidden_effect.toml")]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "it is known why" in printed
    assert "with warm up and linear leak" in printed or "with linear leak and warm up" in printed


def test_an_experiment_is_not_fitted_and_held_out_at_once(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (root / "scenarios" / "hidden_effect.toml").read_text(encoding="utf-8")
    (table,) = (part for part in text.split("\n[") if part.startswith("diagnose]"))
    both = tmp_path / "both.toml"
    chosen = 'diagnose]\nuse = ["triangles", "holds"]\nhold_out = ["triangles"]\n'
    both.write_text(text.replace(table, chosen), encoding="utf-8")
    assert run_command(["run", str(both)]) != 0
    assert "triangles is to be fitted and held out at once" in " ".join(capsys.readouterr().err.split())
