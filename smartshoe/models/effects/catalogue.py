"""Every effect: those of this folder, where to add one is to add its file, and those of other packages.

Another package offers one by an entry point of the group `smartshoe.effects`, whose object is an `Effect` or a class
of it (docs/extending.md).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from smartshoe.errors import UsageError
from smartshoe.models.effects.effect import PLACES, Conditions, Effect, Inverse
from smartshoe.models.effects.exposure import WORDS, Exposure

GROUP = "smartshoe.effects"
ROOM = __name__.rpartition(".")[0]


def _concrete(kind: Any) -> list[type[Effect]]:
    below = [leaf for child in kind.__subclasses__() for leaf in _concrete(child)]
    return below if getattr(kind, "__abstractmethods__", None) else [kind, *below]


@cache
def _found() -> Mapping[str, Effect]:
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        importlib.import_module(f"{ROOM}.{module.name}")
    own = (kind() for kind in _concrete(Effect) if kind.__module__.startswith(ROOM))
    found = {made.name: made for made in own}
    for entry in entry_points(group=GROUP):
        made = _offered(entry)
        if made.name in found:
            raise UsageError(f"{_origin(entry)} has the name {made.name!r}, which is taken: give it another name")
        found[made.name] = made
    return MappingProxyType(dict(sorted(found.items())))


def _origin(entry: EntryPoint) -> str:
    package = f" of the package {entry.dist.name}" if entry.dist else ""
    return f"effect {entry.name!r}{package}"


def _offered(entry: EntryPoint) -> Effect:
    """The effect of another package; raises `UsageError` where it is none, or cannot take part in a chain."""
    try:
        made = entry.load()
        made = made() if isinstance(made, type) else made
    except Exception as error:  # whatever another package does
        raise UsageError(f"{_origin(entry)} cannot be loaded ({error}): mend or uninstall the package") from error
    if not isinstance(made, Effect):
        raise UsageError(f"{_origin(entry)} is {made!r}, no smartshoe.models.effects.Effect: mend the package")
    missing = [word for word in ("name", "family", "stage", "place", "says", "parameters") if not hasattr(made, word)]
    if missing:
        raise UsageError(f"{_origin(entry)} has no {', no '.join(missing)}: mend the package")
    if made.place not in PLACES:
        raise UsageError(f"{_origin(entry)} has the place {made.place!r}: use one of {', '.join(PLACES)}")
    unknown = frozenset[str](made.exposed_by).union(*made.separated_by.values()) - WORDS
    if unknown:
        raise UsageError(
            f"{_origin(entry)} is shown by {', '.join(sorted(unknown))}, which is not known:"
            f" use of {', '.join(sorted(WORDS))}"
        )
    _try(made, _origin(entry))
    return made


def _try(made: Effect, origin: str) -> None:
    """Run an effect of another package once at each of its shapes; raises `UsageError` with what it does wrong."""
    load = 1.0 - np.abs(np.linspace(-1.0, 1.0, 32))
    load.flags.writeable = False  # what writes to its input spoils that of others
    time_s, nothing = np.linspace(0.0, 0.02 * (load.size - 1), load.size), np.zeros(load.size)
    at = Conditions(time_s, load, 0.02, temperature_k=nothing, neighbour=nothing, relaxing=(0.06, 0.2))
    for shape in made.shapes:
        try:
            for values in (made.start(shape), made.begun(shape)):
                of = np.shape(made.apply(load, at, values))
                if of != load.shape:
                    raise ValueError(f"apply gives values of shape {of} for a signal of shape {load.shape}")
            undone = made.inverse(made.begun(shape), 0.02)
            if not isinstance(undone, Inverse | None):
                raise TypeError(f"inverse gives {undone!r}, which is neither an Inverse nor None")
        except Exception as error:  # whatever another package does
            at_shape = "".join(f" at {name} = {value:g}" for name, value in shape.items())
            why = f"{type(error).__name__}: {error}"
            raise UsageError(f"{origin} fails{at_shape} ({why}): mend or uninstall the package") from error


@cache
def catalogue() -> Mapping[str, Effect]:
    """Effects that may be named as a cause, by name, in the order of the names."""
    return MappingProxyType({name: one for name, one in _found().items() if not one.is_flexible})


@cache
def blocks() -> Mapping[str, tuple[Effect, ...]]:
    """The flexible blocks by family: each follows any law of its family, or none that is known; never named."""
    flexible = [one for one in _found().values() if one.is_flexible]
    families = sorted({one.family for one in flexible})
    return MappingProxyType({name: tuple(one for one in flexible if one.family == name) for name in families})


def in_words(name: str) -> str:
    """What a person calls an effect, or any other word of an identifier; a flexible block is one "of free form"."""
    found = _found().get(name)
    said = f"{name.removeprefix('flexible_')} of free form" if found is not None and found.is_flexible else name
    return said.replace("_", " ")


def listed(names: Iterable[str], last: str = "") -> str:
    """What a person calls effects, one after the other: "a, b, c", or with a word before the ``last``: "a, b or c"."""
    said = [in_words(name) for name in names]
    return f"{', '.join(said[:-1])} {last} {said[-1]}" if last and len(said) > 1 else ", ".join(said)


def effect(name: str) -> Effect:
    """The effect or flexible block called ``name``; raises `UsageError` with the names there are."""
    found = _found().get(name)
    if found is None:
        raise UsageError(f"there is no effect {name!r}: use one of {', '.join(_found())}")
    return found


def shift_of(signal: Literal["load", "reading"]) -> Effect:
    """The effect that adds one value to the "load" or to the "reading"."""
    return next(one for one in catalogue().values() if one.shifts == signal)


def between_clocks(what: Literal["lag", "rate"]) -> Effect:
    """The effect whose one value is the "lag" of one clock behind another, or how their "rate" differs."""
    return next(one for one in catalogue().values() if one.between_clocks == what)


def told_apart_by(one: Effect, other: Effect) -> frozenset[Exposure]:
    """What tells the two apart, any of these; either may say it of the other."""
    return one.separated_by.get(other.name, frozenset()) | other.separated_by.get(one.name, frozenset())


@cache
def is_told_from_its_family(one: Effect, present: frozenset[str]) -> bool:
    """Whether data that holds what is ``present`` tells the branch of an effect from the others of its family."""
    family = [law for law in catalogue().values() if law.kind == one.kind]
    own, others = ([law for law in family if (law.branch == one.branch) is alike] for alike in (True, False))
    return any(told_apart_by(law, other) & present for law in own for other in others)
