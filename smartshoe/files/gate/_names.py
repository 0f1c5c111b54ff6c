"""Checks names from files and command lines before they become paths: none leads out of its folder."""

from __future__ import annotations

from pathlib import Path, PurePosixPath, PureWindowsPath

from smartshoe.errors import InputError, UsageError

LONGEST_NAME_BYTES = 180  # of 255 in a file name: suffixes and temporary names need the rest
_FORBIDDEN = frozenset('/\\:*?"<>|')
_RESERVED = frozenset({"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))})


def require_file_name(name: str, what: str) -> str:
    """``name`` unchanged, if it is a valid file name on any system; ``what`` it names ("unit") is for the message.

    Any script is allowed. Raises `UsageError` for separators, for the characters that Windows forbids, for control
    characters, for a leading dot, and for an empty or too long name.
    """
    fault = _fault(name)
    if fault:
        shown = name if len(name) <= 40 else f"{name[:40]}..."
        raise UsageError(f"{what} {shown!r} cannot name a file ({fault}): use letters, digits, '-' and '_'")
    return name


def _fault(name: str) -> str:
    if not name.strip():
        return "it is empty"
    if name != name.strip() or name.startswith(".") or name.endswith("."):
        return "it begins or ends with a blank or a dot"
    bad = next((letter for letter in name if letter in _FORBIDDEN or not letter.isprintable()), None)
    if bad is not None:
        return f"it holds {bad!r}"
    if name.partition(".")[0].casefold() in _RESERVED:
        return "Windows keeps that name for a device"
    if len(name.encode("utf-8", "surrogatepass")) > LONGEST_NAME_BYTES:
        return f"it is longer than {LONGEST_NAME_BYTES} bytes"
    return ""


def inside(folder: Path, name: str, said_by: Path | str) -> Path:
    """The path of ``name`` (``raw/log.csv``) within ``folder``; paths given in a file's content are only made here.

    Raises `InputError` naming ``said_by`` where the name is absolute, or leads out of the folder by ``..`` or by a
    link.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    shown = name if len(name) <= 60 else f"{name[:60]}..."
    refused = InputError(f"{said_by} names the file {shown!r}, which is not inside {folder}: do not trust that file")
    if (
        not parts
        or "\0" in name
        or ".." in parts
        or PurePosixPath(name).is_absolute()
        or PureWindowsPath(name).drive
        or PureWindowsPath(name).root
    ):
        raise refused
    path = folder.joinpath(*parts)
    try:
        if not path.resolve().is_relative_to(folder.resolve()):
            raise refused
    except (OSError, RuntimeError) as error:  # links that form a loop
        raise refused from error
    return path
