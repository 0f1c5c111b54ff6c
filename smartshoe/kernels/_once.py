"""Processes that need the same kernels at once: one compiles each, the others take it from the disk."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any


def compile_each_kernel_once() -> None:
    """Make numba, in this process, wait while another one that does the same compiles a kernel of the same file.

    numba looks on the disk before it compiles, but two that begin at once both compile. Modules import in one
    direction, so that no two processes wait for each other; numba's own lock comes first, so that no two threads do.
    """
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        return
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher

    plain = Dispatcher.compile
    held: set[str] = set()

    @functools.wraps(plain)
    def one_at_a_time(self: Any, sig: Any) -> Any:
        source = self.py_func.__code__.co_filename
        with global_compiler_lock:
            if source in held or not Path(source).is_file():
                return plain(self, sig)
            with Path(source).open() as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                held.add(source)
                try:
                    return plain(self, sig)
                finally:
                    held.discard(source)

    Dispatcher.compile = one_at_a_time  # type: ignore[method-assign]
