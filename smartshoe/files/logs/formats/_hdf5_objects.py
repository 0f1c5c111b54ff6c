"""Safe access to an HDF5 file: no data from other files, no object larger than the file can hold."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from smartshoe.errors import FormatError
from smartshoe.files.gate import foreign_code, limits, require_regular_file, require_values

_DEEPEST = 32
_OBJECTS_PER_COLUMN = 25  # allows for groups, scales, strings and references besides the columns


_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FIRST_PLACE = 512  # a superblock behind another format's header is here, or at any doubling of this
_ADDRESSES_AT = {0: 24, 1: 28}  # offset in superblocks by version; from version 2 on they have checksums
_DRIVER = 3  # its address follows those of the base, the free space and the end
_SUPERBLOCK = 160  # bytes, with the longest addresses; no complete file is shorter


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """The `h5py.File` at ``path``, read only; any error of HDF5 within the block becomes a `FormatError`."""
    import h5py

    require_regular_file(path)
    _require_no_driver(path)
    with foreign_code(path, "HDF5 file", "write it again"), h5py.File(path, "r") as file:
        yield file


def _require_no_driver(path: Path) -> None:
    """Raise `FormatError` where the superblock names a driver: the file is part of several, or damaged.

    HDF5 file format, II.A. The library allocates as much memory as the driver's block declares, up to 4 GB, before it
    reads the block.
    """
    with path.open("rb") as file:
        place, end, start = 0, path.stat().st_size, b""
        while place < end and not start.startswith(_SIGNATURE):
            file.seek(place)
            start = file.read(_SUPERBLOCK)
            place = 2 * place or _FIRST_PLACE
    if not start.startswith(_SIGNATURE) or len(start) < _SUPERBLOCK or start[8] not in _ADDRESSES_AT:
        return  # if anything is wrong, the library reports it
    size = start[13]
    at = _ADDRESSES_AT[start[8]] + _DRIVER * size
    if start[at : at + size] != b"\xff" * size:
        raise FormatError(f"{path} is one of several HDF5 files, or damaged: write it again, as one file")


def vectors(path: Path, file: Any, *, deep: bool) -> list[tuple[str, Any]]:
    """The numeric datasets (name, `h5py.Dataset`); with ``deep`` also those in groups (``group/name``).

    Raises `FormatError` for a link or a dataset whose data lie in another file (external links, external storage,
    virtual datasets), since a file from outside must not choose which files are opened here. Raises `InputError` where
    more is declared than the limits or the file's size allow.
    """
    import h5py

    size = path.stat().st_size
    found: list[tuple[str, Any]] = []
    declared = 0
    for name, item in _objects(path, file, deep=deep):
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "biuf":
            continue
        _require_own_data(path, name, item)
        # A chunk is always unpacked completely, however little of it is requested.
        chunk = 1
        for length in item.chunks or ():
            chunk *= length
        require_values(path, chunk, size, item_bytes=item.dtype.itemsize)
        declared += int(item.size or 0)
        require_values(path, declared, size)
        found.append((name, item))
    return found


def _objects(path: Path, group: Any, *, deep: bool) -> Iterator[tuple[str, Any]]:
    import h5py

    seen: set[Any] = set()
    waiting: list[tuple[str, Any, int]] = [("", group, 0)]
    count = 0
    while waiting:
        prefix, current, depth = waiting.pop()
        for name in current:
            count += 1
            if count > _OBJECTS_PER_COLUMN * limits().columns or depth > _DEEPEST:
                raise FormatError(f"{path} holds too many objects, or too deep: write the measured channels alone")
            link = current.get(name, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise FormatError(
                    f"{path}: {prefix + name!r} is a link to another file: write a file that holds its own data"
                )
            if not isinstance(link, h5py.HardLink):
                continue  # the target of a soft link is found under its own name
            item = current[name]
            if isinstance(item, h5py.Group):
                key = h5py.h5o.get_info(item.id).addr
                if deep and key not in seen:
                    waiting.append((f"{prefix}{name}/", item, depth + 1))
                seen.add(key)
            else:
                yield prefix + name, item


def _require_own_data(path: Path, name: str, dataset: Any) -> None:
    created = dataset.id.get_create_plist()
    if created.get_external_count() > 0 or dataset.is_virtual:
        raise FormatError(f"{path}: the data of {name!r} lie in another file: write a file that holds its own data")
