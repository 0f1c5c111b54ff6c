"""The file formats: all modules of this folder with a ``FORMAT``, and those of installed packages.

A package adds one by the entry-point group ``smartshoe.files`` (docs/extending.md).
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from importlib.metadata import entry_points

from smartshoe.errors import UsageError
from smartshoe.files.logs._sheet import Format

GROUP = "smartshoe.files"


@cache
def formats() -> tuple[Format, ...]:
    """All formats in the order in which they are tried on a file.

    Raises `UsageError` where an installed package's format cannot be loaded, naming it.
    """
    own = [
        importlib.import_module(f"{__name__}.{module.name}").FORMAT
        for module in pkgutil.iter_modules(__path__)
        if not module.name.startswith("_")
    ]
    return tuple(sorted([*own, *_installed()], key=lambda format_: (format_.asked, format_.name)))


def _installed() -> list[Format]:
    found = []
    for entry in entry_points(group=GROUP):
        try:
            format_ = entry.load()
        except Exception as error:
            raise UsageError(
                f"the file format {entry.name} ({entry.value}) cannot be loaded ({error}): update or remove its package"
            ) from error
        if not isinstance(format_, Format):
            raise UsageError(
                f"the file format {entry.name} ({entry.value}) is no smartshoe.files.logs.Format: update it"
            )
        found.append(format_)
    return found
