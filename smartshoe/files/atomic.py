"""Writes files atomically (completely or not at all), and JSON without NaN."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from smartshoe.errors import SmartShoeError, UsageError

_LONGEST_STEM, _LONGEST_ENDING = 40, 12  # characters of the temporary file's name, which may have 255 bytes
_MOST_LINKS = 40  # as in Linux
# Names of the process's own open files, which are not ours to replace.
_STREAMS = {"/dev/stdout": 1, "/dev/stderr": 2}
_DESCRIPTOR = re.compile(r"/dev/std(out|err)|(/dev|/proc/(self|thread-self))/fd/(?P<number>\d{1,6})")


@contextmanager
def replacing(path: Path | str, durable: bool = True) -> Iterator[Path]:
    """Yield a temporary path; when the block ends without an error, its file replaces ``path``.

    The content is on disk before the name is: an error, a kill or a power failure leaves ``path`` either unchanged or
    complete. Without ``durable`` nothing waits for the disk: a kill still does no harm, but a power failure may leave
    an empty file. A symbolic link to a file is kept, and the file it points to is replaced. A device or a pipe
    (``/dev/null``, ``/dev/stdout``) is never replaced: the complete content is written to it. Raises `UsageError` where
    nothing can be written, including a full disk within the block.
    """
    try:
        target, streamed = _place(Path(path))
        named = target if isinstance(target, Path) else Path(path)
        folder = Path(tempfile.gettempdir()) if streamed else named.parent
        # The suffix is kept, as some writers choose the format by it.
        handle, name = tempfile.mkstemp(
            dir=folder, prefix=f".{named.stem[:_LONGEST_STEM]}.", suffix=f".partial{named.suffix[:_LONGEST_ENDING]}"
        )
    except UsageError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise _unwritable(path, error) from error
    os.close(handle)
    temporary = Path(name)
    try:
        if not streamed:
            # mkstemp creates private files; a result file follows the user's umask like any other.
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o666 & ~umask)
        yield temporary
        if streamed:
            with suppress(BrokenPipeError):  # the reader has gone (head, less), which is no error of ours
                _write_through(temporary, target)
        else:
            if durable:
                _to_disk(temporary)
            temporary.replace(named)
            if durable:
                sync_folder(named.parent)
    except SmartShoeError:
        raise
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink()  # it no longer exists once it has replaced its target


def _unwritable(path: Path | str, error: Exception) -> UsageError:
    reason = getattr(error, "strerror", None) or str(error)
    mends: dict[int | None, str] = {
        errno.ENOSPC: "free some space",
        errno.EDQUOT: "free some space",
        errno.EFBIG: "choose another disk",
        errno.ENAMETOOLONG: "choose a shorter name",
        errno.ENXIO: "start the program that reads the pipe first",
    }
    mend = mends.get(getattr(error, "errno", None), "choose a folder that exists and is writable")
    return UsageError(f"{path} cannot be written ({reason}): {mend}; nothing half-written is left")


def _place(path: Path) -> tuple[Path | int, bool]:
    """Where content for ``path`` goes, and whether it is streamed there.

    The place is a path with links resolved, or an open descriptor.
    """
    for _ in range(_MOST_LINKS):
        descriptor = _DESCRIPTOR.fullmatch(os.path.normpath(Path.cwd() / path))
        if descriptor:
            return _STREAMS.get(descriptor[0]) or int(descriptor["number"]), True
        if not path.is_symlink():
            break
        _refuse_strangers_link(path)
        path = path.parent / path.readlink()
    else:
        raise UsageError(f"{path} is a link that leads to itself: remove it")
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return path, False
    if stat.S_ISDIR(mode):
        raise UsageError(f"{path} is a directory: give the name of a file to write")
    if stat.S_ISCHR(mode) or stat.S_ISFIFO(mode):
        return path, True
    if not stat.S_ISREG(mode):
        raise UsageError(f"{path} is a disk or a socket: give the name of a file to write")
    return path, False


def _refuse_strangers_link(path: Path) -> None:
    """Refuse a link that another user created in a world-writable folder."""
    if not hasattr(os, "geteuid"):
        return
    owner, folder = path.lstat().st_uid, path.parent.stat()
    if folder.st_mode & stat.S_IWOTH and owner not in (os.geteuid(), folder.st_uid):
        raise UsageError(f"{path} is a link that somebody else laid: remove it, or give another name")


def _write_through(content: Path, target: Path | int) -> None:
    """Write all of ``content`` to a device, pipe or descriptor.

    Raises `OSError` (ENXIO) where nobody reads the pipe.
    """
    if isinstance(target, int):
        sys.stdout.flush()
        handle = os.dup(target)
    else:
        handle = os.open(target, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))
        os.set_blocking(handle, True)
    with content.open("rb") as source, os.fdopen(handle, "wb") as sink:
        shutil.copyfileobj(source, sink)


def _to_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sync_folder(folder: Path) -> None:
    """Sync a folder to disk, since a new file's name is on disk only once its folder is."""
    if os.name == "nt":  # Windows cannot open a folder
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
    except PermissionError:  # the folder may be written to, but not listed
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some network file systems lack this call
            raise
    finally:
        os.close(handle)


def write_text(path: Path | str, text: str, durable: bool = True) -> None:
    """Write ``text`` as UTF-8 to ``path``, atomically as `replacing` does."""
    with replacing(path, durable) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def json_text(result: Mapping[str, Any]) -> str:
    """The result as JSON text; NaN and infinity raise an error."""
    import json

    return json.dumps(result, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


@contextmanager
def results_folder(path: Path | str) -> Iterator[Path]:
    """Yield `make_folder` of ``path``; if the block fails, folders that it created and left empty are removed."""
    made = [place for place in (Path(path), *Path(path).parents) if not place.exists()]
    try:
        yield make_folder(path)
    except BaseException:
        for place in made:
            with suppress(OSError):  # a folder that is not empty is kept
                place.rmdir()
        raise


def make_folder(path: Path | str) -> Path:
    """Create the folder ``path`` (and parents) where it is missing, and check that it can be written to.

    The names of new folders are on disk when this returns, since losing a folder means losing the files in it.
    """
    folder = Path(path)
    try:
        missing = [place for place in (folder, *folder.parents) if not place.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        for place in reversed(missing):
            sync_folder(place.parent)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise UsageError(f"{folder} cannot be made a folder ({reason}): choose another --out") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"{folder} is not writable: choose another --out")
    return folder
