"""Guards readers of other packages: any exception becomes one sentence, and a file's declared sizes are checked."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from smartshoe.errors import FormatError, InputError, SmartShoeError
from smartshoe.files.gate.limits import FREELY_UNPACKED, limits

_LONGEST_REASON = 80


@contextmanager
def foreign_code(path: Path, kind: str, mend: str) -> Iterator[None]:
    """Within the block a library reads the untrusted ``path`` as ``kind`` ("TDMS file").

    Any exception, from a missing key to insufficient memory, becomes a `FormatError` that names the file and says how
    to ``mend`` it, since a library does not promise which exceptions it raises. The cause is chained.
    """
    try:
        yield
    except SmartShoeError:
        raise
    except MemoryError as error:
        raise InputError(f"{path} asks for more memory than there is: {mend}") from error
    except Exception as error:
        reason = " ".join(str(error).split())
        reason = f"{reason[:_LONGEST_REASON]}..." if len(reason) > _LONGEST_REASON else reason or type(error).__name__
        raise FormatError(f"{path} is truncated or no {kind} ({reason}): {mend}") from error


def require_columns(path: Path, count: int) -> None:
    """Raise `InputError` where a file has more columns than the limit."""
    bound = limits().columns
    if count > bound:
        raise InputError(
            f"{path} has {count} columns, more than {bound}: export the channels that are needed, or raise the limit"
            f" with --limit columns={count}"
        )


def require_values(path: Path, count: int, size: int | None = None, *, item_bytes: int = 8) -> None:
    """Raise `InputError` where a file declares more values than the limit, or far more than its ``size`` can hold.

    It declares ``count`` values of ``item_bytes`` once unpacked; ``size`` is its number of bytes on disk (None: not
    checked).
    """
    bound = limits()
    if count > bound.values:
        raise InputError(
            f"{path} declares {count} values, more than {bound.values}: split it, or raise the limit with --limit"
            f" values={count}"
        )
    unpacked = count * item_bytes
    if size is not None and unpacked > max(FREELY_UNPACKED, bound.expansion * size):
        raise FormatError(
            f"{path} declares {unpacked} bytes of data and has {size}: write it again, or raise the limit with"
            f" --limit expansion={-(-unpacked // max(size, 1))}"
        )
