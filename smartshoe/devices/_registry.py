"""Opens devices by URL, ``SCHEME:TARGET?option=value``; the scheme names a provider found by its entry point.

A provider has ``open_machine(target, options, rng)``, ``open_shoe(target, options, rng)`` or both. It raises
`UsageError` for a target that it does not know.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any
from urllib.parse import parse_qsl

from smartshoe.devices._base import Shoe, TestMachine
from smartshoe.errors import OptionError, UsageError

GROUP = "smartshoe.devices"


def split_url(url: str) -> tuple[str, str, dict[str, str]]:
    """Scheme, target and options of a URL such as ``sim:instron?unit=left_toe``.

    Raises `UsageError` without a scheme.
    """
    if not isinstance(url, str):
        raise UsageError(f"a device's address is of type {type(url).__name__}: give text like 'sim:instron'")
    scheme, colon, rest = url.partition(":")
    if not colon or not scheme:
        raise UsageError(f"device {url!r} has no scheme: write it like sim:instron or log:Specimen_RawData_1.csv")
    target, _, query = rest.partition("?")
    return scheme, target.removeprefix("//"), dict(parse_qsl(query, keep_blank_values=True))


@cache
def _offered() -> dict[str, EntryPoint]:
    """Entry points of all providers by scheme.

    Cached, since scanning the installed packages takes as long as a simulation.
    """
    # From Python 3.12 on, entry points are indexed by name rather than position, so that they cannot be reversed.
    return {entry.name: entry for entry in reversed(tuple(entry_points(group=GROUP)))}


def schemes() -> tuple[str, ...]:
    """The schemes that installed packages provide."""
    return tuple(sorted(_offered()))


def _open(url: str, what: str, options: Mapping[str, Any]) -> Any:
    scheme, target, in_url = split_url(url)
    found = _offered().get(scheme)
    if found is None:
        raise UsageError(f"device {url!r}: scheme {scheme!r} is not installed; there are {', '.join(schemes())}")
    opener = getattr(found.load(), f"open_{what}", None)
    if opener is None:
        raise UsageError(f"device {url!r}: {scheme!r} has no {what}s; use another scheme ({', '.join(schemes())})")
    import numpy as np

    merged: dict[str, Any] = {**in_url, **options}
    seed = merged.pop("seed", 0)
    try:
        rng = np.random.default_rng(int(seed))
    except (TypeError, ValueError) as error:
        raise UsageError(f"device {url!r}: seed is {seed!r}; give a whole number from 0") from error
    from pydantic import ValidationError

    try:
        return opener(target, merged, rng)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        keys = tuple(first["loc"])
        what_is_wrong = "is not known" if first["type"] == "extra_forbidden" else first["msg"]
        raise OptionError(f"device {url!r}: option {'.'.join(map(str, keys))!r}: {what_is_wrong}", keys) from error


def open_machine(url: str, /, **options: Any) -> TestMachine:
    """The testing machine at ``url``, to be used in a with block.

    Parameters
    ----------
    url
        ``SCHEME:TARGET?option=value``: "sim:instron", "log:Specimen_RawData_1.csv", or another package's.
    **options
        The device's, as in the URL; ``seed`` (default 0) is the random root of one that is simulated.

    Raises
    ------
    UsageError
        For an unknown scheme or target.
    OptionError
        For an option that the device refuses.

    Examples
    --------
    >>> import smartshoe
    >>> with smartshoe.open_machine("sim:instron", unit="left_toe", seed=1) as machine:
    ...     pressed = machine.run(smartshoe.dynamic_protocol((400.0,)))
    >>> pressed.unit, float(pressed.force_n.max().round(-1))
    ('left_toe', 800.0)
    """
    machine: TestMachine = _open(url, "machine", options)
    return machine


def open_shoe(url: str, /, **options: Any) -> Shoe:
    """The shoe at ``url``, to be used in a with block: ``for block in shoe.blocks()``.

    Parameters
    ----------
    url
        "serial:///dev/rfcomm0", "sim:walk", "sim:stand", "replay:FILE", or another package's.
    **options
        The device's, as in the URL; ``seed`` (default 0) is the random root of one that is simulated.

    Raises
    ------
    UsageError
        For an unknown scheme or target.
    OptionError
        For an option that the device refuses.

    Examples
    --------
    >>> import smartshoe
    >>> with smartshoe.open_shoe("sim:stand", seed=1) as shoe:
    ...     standing = shoe.record(0.5)
    >>> sorted(standing.channels)[:2]
    ['left_heel', 'left_meta1']
    """
    shoe: Shoe = _open(url, "shoe", options)
    return shoe
