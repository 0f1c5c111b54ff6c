"""The kernels are compiled once, however many commands begin at the same time."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from smartshoe.kernels import warm_up
from smartshoe.kernels._once import compile_each_kernel_once


def test_while_one_process_compiles_a_kernel_no_other_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")
    from numba.core.dispatcher import Dispatcher

    source = tmp_path / "kernel.py"
    source.write_text("def passed(x):\n    return x\n")
    names: dict[str, object] = {}
    exec(compile(source.read_text(), source, "exec"), names)
    free: list[bool] = []

    def looked_at(self: object, sig: object) -> None:
        with source.open() as other:
            try:
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
                free.append(True)
            except BlockingIOError:
                free.append(False)

    monkeypatch.setattr(Dispatcher, "compile", looked_at)
    compile_each_kernel_once()
    Dispatcher.compile(SimpleNamespace(py_func=names["passed"]), None)
    looked_at(None, None)
    assert free == [False, True]


def test_where_nothing_can_be_kept_nothing_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm_up, "CACHE", tmp_path / "not_there")
    monkeypatch.setattr(warm_up, "compile_all", lambda: pytest.fail("compiled for nobody"))
    assert not warm_up.compile_alone()


def test_the_warm_up_runs_in_a_process_of_its_own() -> None:
    import subprocess
    import sys

    subprocess.run([sys.executable, "-m", warm_up.__name__], check=True)
