"""Writing files whole or not at all, and JSON without NaN."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from smartshoe.errors import UsageError


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; move it over ``path`` when the block ends without an error.

    An error, or a kill, leaves ``path`` as it was. Raises `UsageError` where nothing can be written.
    """
    target = Path(path)
    if target.is_dir():
        raise UsageError(f"{target} is a directory: give the name of a file to write")
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}.", suffix=f".partial{target.suffix}")
    except OSError as error:
        raise UsageError(
            f"{target} cannot be written ({error.strerror}): choose a folder that exists and is writable"
        ) from error
    os.close(handle)
    temporary = Path(name)
    try:
        # mkstemp makes files private; a result file follows the user's umask like any other.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        yield temporary
        try:
            temporary.replace(target)
        except OSError as error:
            raise UsageError(f"{target} cannot be written ({error.strerror})") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path | str, text: str) -> None:
    """Write ``text`` as UTF-8 to ``path``, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def json_text(result: Mapping[str, Any]) -> str:
    """The result as JSON text; NaN and infinity are an error, never written."""
    import json

    return json.dumps(result, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def make_folder(path: Path | str) -> Path:
    """Create the folder ``path`` (and parents) where it is missing, checking that it can be written to."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot be made a folder ({error.strerror}): choose another --out") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"{folder} is not writable: choose another --out")
    return folder
