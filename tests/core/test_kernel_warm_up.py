"""The kernels are compiled once, however many commands begin at the same time."""

from __future__ import annotations

from pathlib import Path

import pytest

from smartshoe.kernels import warm_up


def test_a_second_process_leaves_the_compilation_to_the_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")
    calls: list[int] = []
    monkeypatch.setattr(warm_up, "CACHE", tmp_path)
    monkeypatch.setattr(warm_up, "compile_all", lambda: calls.append(1))
    with (tmp_path / "warm_up.lock").open("a") as first:
        fcntl.flock(first, fcntl.LOCK_EX | fcntl.LOCK_NB)
        assert not warm_up.compile_alone()
    assert warm_up.compile_alone()
    assert calls == [1]


def test_where_nothing_can_be_kept_nothing_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm_up, "CACHE", tmp_path / "not_there")
    monkeypatch.setattr(warm_up, "compile_all", lambda: pytest.fail("compiled for nobody"))
    assert not warm_up.compile_alone()
