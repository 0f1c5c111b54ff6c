"""Names of exported filters, valid for C, MATLAB and files at once."""

from __future__ import annotations

import re
from collections.abc import Sequence

from smartshoe.calibration._calibration import Calibration
from smartshoe.errors import UsageError

DEFAULT_NAME = "smartshoe_filter"
TWIN_NAME = "smartshoe_twin"
LONGEST = 63  # significant characters in both C99 and MATLAB

# C99 6.4.1 and C++ keywords that C lacks, MATLAB's keywords, and names that the C code itself uses.
_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    bool catch class delete explicit export false friend mutable namespace new operator private protected public
    template this throw true try typename using virtual elseif end function global otherwise parfor persistent spmd
    main isfinite
"""
# Files of these names would hide the standard library's headers.
_HEADERS = """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdarg stdbool stddef
    stdint stdio stdlib string tgmath time wchar wctype
"""
_TAKEN = frozenset(f"{_KEYWORDS} {_HEADERS}".split())


def names_of(
    calibrations: Sequence[Calibration], given: Sequence[str] = (), default: str = DEFAULT_NAME
) -> tuple[str, ...]:
    """One name per calibration, ``given`` by the user or made from the units' names.

    One calibration: the given name, else ``default``. Several: one name each, or one prefix for the units' names, or
    the units' names alone. Raises `UsageError` for a name that C or MATLAB cannot use, and for two equal ones.
    """
    count = len(calibrations)
    if len(given) not in (0, 1, count):
        raise UsageError(f"--name is given {len(given)} times for {count} calibrations: give it once, or once for each")
    if count == 1:
        found = tuple(given) or (default,)
    elif len(given) == count:
        found = tuple(given)
    else:
        before = f"{given[0]}_" if given else ""
        found = tuple(before + _from_unit(calibration.unit, k) for k, calibration in enumerate(calibrations, start=1))
    for name in found:
        _check(name)
    _check_apart(found)
    return found


def _from_unit(unit: str, number: int) -> str:
    """The unit's name with all characters that an identifier may not contain replaced by underscores."""
    made = re.sub(r"[^A-Za-z0-9]+", "_", unit).strip("_")
    if not made:
        raise UsageError(f"calibration {number} has no unit name to call its files by: give --name once for each")
    return made if made[0].isalpha() else f"unit_{made}"


def _check(name: str) -> None:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or len(name) > LONGEST:
        raise UsageError(
            f"name {name!r} is no name in C: use letters, digits and underscores, a letter first, {LONGEST} at most"
        )
    if name.lower() in _TAKEN:
        raise UsageError(f"name {name!r} is taken by the language or its library: choose another --name")


def _check_apart(names: Sequence[str]) -> None:
    seen: set[str] = set()
    for name in names:
        # Some file systems ignore case.
        if name.lower() in seen:
            raise UsageError(f"two calibrations are both called {name!r}: give --name once for each, all different")
        seen.add(name.lower())
    for name in names:
        if f"{name}_test".lower() in seen:
            raise UsageError(f"{name}_test is the self-test of {name} and a calibration's name: choose another --name")
