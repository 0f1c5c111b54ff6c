"""Standard output and error whose reader may go before the command has ended, as ``head`` does."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class _Dropping(io.TextIOWrapper):
    """Drops what is written once nobody reads it, so that the command's work is done and its exit status is its own."""

    is_read = True

    def write(self, text: str) -> int:
        """Write ``text``, as to any text stream."""
        try:
            return super().write(text)
        except BrokenPipeError:
            self._drop()
            return len(text)

    def flush(self) -> None:
        """Pass on what was written, as of any text stream."""
        try:
            super().flush()
        except BrokenPipeError:
            self._drop()

    def _drop(self) -> None:
        """Direct this and all later output to nowhere, as Python's documentation has it under SIGPIPE."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())
        os.close(nowhere)
        self.is_read = False


@contextmanager
def dropping_what_nobody_reads() -> Iterator[None]:
    """Let the readers of this process's standard output and error go without an error of the command."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = made = _dropping(sys.stdout), _dropping(sys.stderr)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        for one in made:
            if isinstance(one, _Dropping):
                one.detach()  # else its end would close the file of the stream before


def _dropping(stream: Any) -> Any:
    """``stream`` as a `_Dropping` one, where it is a text file and not None or an object of another kind.

    A character that its encoding has not, as in a file's name under a code page, is written as an escape.
    """
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    stream.flush()
    errors = "backslashreplace" if stream.errors == "strict" else stream.errors
    return _Dropping(stream.buffer, encoding=stream.encoding, errors=errors, line_buffering=stream.line_buffering)


def is_output_read() -> bool:
    """Whether standard output still has its reader, as far as the last writing showed."""
    return not isinstance(sys.stdout, _Dropping) or sys.stdout.is_read
