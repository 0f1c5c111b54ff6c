"""Reads files from outside: regular files only, up to a bounded size."""

from __future__ import annotations

import stat
from pathlib import Path

from smartshoe.errors import InputError
from smartshoe.files.gate.limits import limits

_KINDS = (
    (stat.S_ISDIR, "a folder", "name a file in it"),
    (stat.S_ISFIFO, "a pipe", "write its content to a file first"),
    (stat.S_ISCHR, "a device", "write its content to a file first"),
    (stat.S_ISBLK, "a disk", "give a file"),
    (stat.S_ISSOCK, "a socket", "give a file"),
)


def require_regular_file(path: Path, *, at_most: int | None = None) -> int:
    """The size in bytes of the regular file at ``path``.

    Raises `InputError` where it does not exist, where it is a folder, pipe or device (which may never end), and where
    it is larger than ``at_most`` (default: the limit ``file_bytes``).
    """
    if path.name == "-" and not path.exists():
        raise InputError(f"{path} is no file, and standard input cannot be read: write its content to a file first")
    try:
        state = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path} does not exist: check its name and folder") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check its name and permissions") from error
    except ValueError as error:  # a name that contains a zero byte
        raise InputError(f"{str(path)!r} is no name of a file ({error}): check it") from error
    for is_kind, what, mend in _KINDS:
        if is_kind(state.st_mode):
            raise InputError(f"{path} is {what}: {mend}")
    bound, name = (limits().file_bytes, "file_bytes") if at_most is None else (at_most, "json_bytes")
    if state.st_size > bound:
        raise InputError(
            f"{path} has {state.st_size} bytes, more than {bound}: split it, or raise the limit with --limit"
            f" {name}={state.st_size}"
        )
    return state.st_size


def read_bytes(path: Path, *, at_most: int | None = None) -> bytes:
    """The content of the regular file at ``path``; raises the errors of `require_regular_file`."""
    size = require_regular_file(path, at_most=at_most)
    try:
        with path.open("rb") as file:
            content = file.read(size + 1)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check its permissions") from error
    return content


def read_text(path: Path, what: str) -> str:
    """The UTF-8 text of a small file, without a leading byte order mark; raises `InputError`.

    ``what`` the file should be ("a calibration") is named in the message.
    """
    content = read_bytes(path, at_most=limits().json_bytes)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is no text (byte {error.start}): give {what}") from error
