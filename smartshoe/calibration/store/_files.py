"""The store on disk: one file per calibration and per event, each named by its content; and their index.

``units/SERIAL/DATE_HASH.json`` is a calibration that any command reads, with the store's own data under the key
``store``. ``events/DATE_HASH.json`` is an event. A name contains the beginning of the sha256 of the file's bytes: two
processes that add at once cannot write different content under one name, and a file that was truncated or edited by
hand is noticed. ``index.json`` repeats what the files say; it is rebuilt from them and may be deleted at any time.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from smartshoe.calibration.store._entry import EVENT_KINDS, Entry, HistoryEvent
from smartshoe.calibration.store.dates import iso, moment
from smartshoe.errors import InputError, UsageError
from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.files.gate import limits, parsed_json, read_bytes, read_text

INDEX, UNITS, EVENTS = "index.json", "units", "events"
INDEX_SCHEMA, EVENT_SCHEMA = "smartshoe.store.index/1", "smartshoe.store.event/1"
HASH_DIGITS = 16
LONGEST_SERIAL = 80  # once escaped, every character may take three of the 255 bytes of a file name


def folder_name(serial_number: str) -> str:
    """The folder name of a unit; all but letters, digits, '-', '_' and inner '.' is escaped, so no name leads outside.

    Raises `UsageError` where the serial number is empty or too long.
    """
    if not serial_number.strip():
        raise UsageError("the calibration has no serial number: give one with --serial-number, as on the unit's label")
    if not serial_number.isprintable():
        raise UsageError(f"serial number {serial_number!r} holds what cannot be printed: write it as on the label")
    if len(serial_number) > LONGEST_SERIAL:
        raise UsageError(f"serial number {serial_number[:20]}... is longer than {LONGEST_SERIAL} letters: shorten it")
    quoted = quote(serial_number, safe="")
    return f"%2E{quoted[1:]}" if quoted.startswith(".") else quoted


def fingerprint(calibration: Mapping[str, Any]) -> str:
    """sha256 of a calibration's object, ignoring the store's own data in it."""
    bare = {key: value for key, value in calibration.items() if key != "store"}
    return hashlib.sha256(json.dumps(bare, sort_keys=True).encode()).hexdigest()


def _write_named(folder: Path, date: str, content: Mapping[str, Any]) -> Path:
    text = json_text(content)
    # Not every file system allows ':' in a name.
    name = f"{date.replace(':', '')}_{hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]}.json"
    path = folder / name
    try:
        make_folder(folder)
        if not path.exists():  # the same name means the same content
            write_text(path, text)
    except (OSError, UsageError) as error:
        raise UsageError(
            f"{path} cannot be written ({getattr(error, 'strerror', None) or error.__cause__ or error}): give a folder"
            " with room and the right to write with --store"
        ) from error
    return path


def write_calibration(root: Path, calibration: Mapping[str, Any], store: Mapping[str, Any]) -> Path:
    """Write a calibration's object with the store's data added; returns the path. Nothing is ever overwritten."""
    folder = root / UNITS / folder_name(store["serial_number"])
    return _write_named(folder, store["date"], {**calibration, "store": dict(store)})


def write_event(root: Path, event: HistoryEvent) -> Path:
    """Write an event; returns the path."""
    folder_name(event.serial_number)
    return _write_named(root / EVENTS, iso(event.date), {"schema": EVENT_SCHEMA, **event.to_dict()})


def listing(root: Path) -> dict[str, tuple[int, int]]:
    """Every file of the store, by its path within it: (size, modification time in ns), to detect later changes."""
    found: dict[str, tuple[int, int]] = {}
    for pattern in (f"{UNITS}/*/*.json", f"{EVENTS}/*.json"):
        for path in sorted(root.glob(pattern)):
            if path.name.startswith("."):  # a file still being written
                continue
            try:
                state = path.stat()
            except FileNotFoundError:  # removed since the folder was listed
                continue
            found[path.relative_to(root).as_posix()] = (state.st_size, state.st_mtime_ns)
    return found


def read_item(root: Path, relative: str) -> dict[str, Any]:
    """The index's item for a file; raises `InputError` where the file has changed since it was added."""
    path = root / relative
    content = read_bytes(path, at_most=limits().json_bytes)
    if hashlib.sha256(content).hexdigest()[:HASH_DIGITS] != path.stem.rpartition("_")[2]:
        raise InputError(
            f"{path} is not as it was added (cut or changed since): it is left out; take it away and add the"
            " calibration anew"
        )
    try:
        found = parsed_json(content)
        if relative.startswith(f"{EVENTS}/"):
            return {key: found[key] for key in ("kind", "serial_number", "date", "position", "note", "order")}
        return {**found["store"], "fingerprint": fingerprint(found)}
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is no file of a store ({error!r}): take it out of the folder") from error


def made_of(
    root: Path, relative: str, state: tuple[int, int], cached: object
) -> tuple[dict[str, Any], Entry | HistoryEvent]:
    """A file's index item and the entry or event in it; ``cached``, the index's own, is used where ``state`` matches.

    A damaged index costs only time: the file itself is read instead. Raises `InputError` where that is not a file of a
    store.
    """
    if isinstance(cached, dict) and cached.get("state") == list(state):
        with suppress(InputError, KeyError):
            return cached["item"], _made(root, relative, cached["item"])
    item = read_item(root, relative)
    return item, _made(root, relative, item)


def _made(root: Path, relative: str, item: Mapping[str, Any]) -> Entry | HistoryEvent:
    try:
        return event_of(item) if relative.startswith(f"{EVENTS}/") else entry_of(root, relative, item)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{root / relative} is no file of a store ({error!r}): take it out of the folder") from error


def entry_of(root: Path, relative: str, item: Mapping[str, Any]) -> Entry:
    """The calibration that the index's ``item`` describes."""
    path = root / relative
    return Entry(
        path.stem,
        _text(item, "serial_number"),
        moment(_text(item, "date")),
        _text(item, "position"),
        None if item["valid_for_days"] is None else float(item["valid_for_days"]),
        _text(item, "note"),
        int(item["order"]),
        _text(item, "fingerprint"),
        path,
    )


def event_of(item: Mapping[str, Any]) -> HistoryEvent:
    """The event that the index's ``item`` describes."""
    if item["kind"] not in EVENT_KINDS:
        raise InputError(f"event {item['kind']!r} is not known: use a newer smartshoe")
    return HistoryEvent(
        item["kind"],
        _text(item, "serial_number"),
        moment(_text(item, "date")),
        _text(item, "position"),
        _text(item, "note"),
        int(item["order"]),
    )


def _text(item: Mapping[str, Any], key: str) -> str:
    found = item[key]
    if not isinstance(found, str):
        raise TypeError(f"{key} is {found!r}, no text")
    return found


def read_index(root: Path) -> dict[str, Any]:
    """The index's items by file; {} where there is no usable index, which only costs time."""
    try:
        found = parsed_json(read_text(root / INDEX, "a store's index"))
        if found["schema"] == INDEX_SCHEMA and isinstance(found["files"], dict):
            return dict(found["files"])
    except (InputError, ValueError, KeyError, TypeError):
        return {}
    return {}


def write_index(root: Path, files: Mapping[str, Any]) -> str:
    """Write the index if the folder is writable; a read-only store works without one.

    Returns what went wrong, or ''. Without an index everything is still found, only more slowly.
    """
    if not os.access(root, os.W_OK | os.X_OK):
        return ""
    try:
        write_text(root / INDEX, json_text({"schema": INDEX_SCHEMA, "files": dict(files)}))
    except (OSError, UsageError) as error:
        return f"{root / INDEX} cannot be written ({error}): make room, it saves time"
    return ""
