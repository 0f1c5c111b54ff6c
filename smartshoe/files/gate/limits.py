"""Limits of what a file or a protocol may request; they can be raised by ``--limit`` or ``$SMARTSHOE_LIMITS``."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cache

from smartshoe.errors import UsageError

VARIABLE = "SMARTSHOE_LIMITS"


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest sizes that are accepted.

    ``values`` are samples times channels of one file; ``expansion`` is how many times larger than its file the content
    of a compressed one may be (not checked below `FREELY_UNPACKED` bytes). ``json_bytes`` and ``json_depth`` apply to
    calibrations, plans, events and indices. ``segments`` are those of a protocol, ``duration_s`` is its duration or
    that of a simulated stream. ``samples`` are those that a simulated pressing computes at its fine step, about 170
    bytes each; ``cases`` are those of a sweep.
    """

    file_bytes: int = 4 << 30
    values: int = 200_000_000
    columns: int = 4096
    expansion: int = 100
    json_bytes: int = 64 << 20
    json_depth: int = 100
    duration_s: int = 7 * 24 * 3600
    samples: int = 5_000_000
    segments: int = 100_000
    cases: int = 1_000_000


FREELY_UNPACKED = 32 << 20
_raised: list[str] = []


def raise_limits(settings: Iterable[str]) -> None:
    """Set limits of this process from texts ``NAME=NUMBER``; raises `UsageError` for an unknown limit."""
    before = list(_raised)
    _raised[:] = settings
    limits.cache_clear()
    try:
        limits()
    except UsageError:
        _raised[:] = before
        raise


@cache
def limits() -> Limits:
    """The limits in force: the built-in ones, changed by ``$SMARTSHOE_LIMITS`` and `raise_limits`."""
    known = {field.name for field in fields(Limits)}
    changed: dict[str, int] = {}
    for setting in (*os.environ.get(VARIABLE, "").split(","), *_raised):
        if not setting.strip():
            continue
        name, _, value = (part.strip() for part in setting.partition("="))
        if name not in known:
            raise UsageError(f"limit {name!r} is not known: use one of {', '.join(sorted(known))}")
        try:
            number = float(value)
            changed[name] = int(number)
        except (ValueError, OverflowError):
            raise UsageError(f"limit {name} is {value!r}: give a number, for example {name}=1e9") from None
        if changed[name] < 1:
            raise UsageError(f"limit {name} is {value!r}: give a number of 1 or more")
    return replace(Limits(), **changed)
