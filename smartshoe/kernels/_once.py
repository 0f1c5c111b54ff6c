"""Processes that need the same kernels at once: one compiles each kernel, the others load it from the disk."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any


def compile_each_kernel_once() -> None:
    """Make numba in this process wait while another process compiles a kernel of the same file.

    numba looks on the disk before it compiles, but two processes that begin at once would both compile. There is no
    deadlock: modules import in one direction, so no two processes wait for each other, and numba's own lock is taken
    first, so no two threads do.
    """
    try:
        import fcntl
    except ImportError:  # Windows lacks these locks
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
