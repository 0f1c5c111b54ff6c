"""The catalogue of effects: those of this folder, one file each, and those of other packages.

Another package offers one by an entry point of the group `smartshoe.effects`, whose object is an `Effect` or a class of
it (docs/extending.md).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from traceback import walk_tb
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.models.effects._offered import refuse_faulty
from smartshoe.models.effects.effect import Effect
from smartshoe.models.effects.exposure import Exposure

GROUP = "smartshoe.effects"
ROOM = __name__.rpartition(".")[0]


def _concrete(kind: Any) -> list[type[Effect]]:
    """All classes below ``kind``, itself among them, that have no abstract methods."""
    below = [leaf for child in kind.__subclasses__() for leaf in _concrete(child)]
    return below if getattr(kind, "__abstractmethods__", None) else [kind, *below]


@cache
def _own() -> Mapping[str, Effect]:
    """The effects of this folder by name."""
    for module in pkgutil.iter_modules([str(Path(__file__).parent)]):
        importlib.import_module(f"{ROOM}.{module.name}")
    own = (kind() for kind in _concrete(Effect) if kind.__module__.startswith(ROOM))
    return MappingProxyType({made.name: made for made in own})


class _Offer(NamedTuple):
    """An effect of another package, and the words that name it and the package in an error."""

    effect: Effect
    origin: str


@cache
def _offers() -> tuple[Mapping[str, _Offer], tuple[UsageError, ...]]:
    """The effects of other packages by name, and the errors of those that are faulty.

    An error is raised only where the effects of other packages are needed.
    """
    found: dict[str, _Offer] = {}
    broken = []
    for entry in entry_points(group=GROUP):
        origin = _origin(entry, entry.name)  # it may have no other name yet
        try:
            offered = _offered(entry, origin)
            if offered.name in found or offered.name in _own():
                raise UsageError(f"{origin} has the name {offered.name!r}, which is taken: give it another name")
            found[offered.name] = _Offer(offered, _origin(entry, offered.name))
        except UsageError as error:
            broken.append(error)
    return MappingProxyType(found), tuple(broken)


@cache
def _found() -> Mapping[str, Effect]:
    """All effects by name, in the order of the names; raises the first error of another package's."""
    offers, broken = _offers()
    if broken:
        raise broken[0]
    return MappingProxyType(dict(sorted({**_own(), **{name: one.effect for name, one in offers.items()}}.items())))


def _origin(entry: EntryPoint, name: str) -> str:
    """Words for an effect of another package: "effect 'creased_tube' of the package our-lab"."""
    return f"effect {name!r}" + (f" of the package {entry.dist.name}" if entry.dist else "")


def _offered(entry: EntryPoint, origin: str) -> Effect:
    """The effect of another package; raises `UsageError` where it is none, or cannot take part in a chain."""
    try:
        offered = entry.load()
        offered = offered() if isinstance(offered, type) else offered
    except (Exception, SystemExit) as error:  # whatever another package does
        why = f"{type(error).__name__}: {error}"
        raise UsageError(f"{origin} cannot be loaded ({why}): mend or uninstall the package") from error
    if not isinstance(offered, Effect):
        raise UsageError(f"{origin} is {offered!r}, no smartshoe.models.effects.Effect: mend the package")
    refuse_faulty(offered, origin)
    return offered


def _named(name: str) -> Effect | None:
    """The effect ``name``, or None. Those of this folder are found whatever other packages offer."""
    if name in _own():
        return _own()[name]
    offer = _offers()[0].get(name)
    return None if offer is None else offer.effect


def origin_of(name: str) -> str:
    """Words for who offers the effect ``name``, for an error: "effect 'creased_tube' of the package our-lab"."""
    offer = None if name in _own() else _offers()[0].get(name)
    return f"effect {name!r}" if offer is None else offer.origin


def refuse_other_size(name: str, found: Array, size: int) -> None:
    """Raises `UsageError` where the output ``found`` of the effect ``name`` is not of shape (``size``,)."""
    if found.shape != (size,):
        raise UsageError(
            f"{origin_of(name)} gives values of shape {found.shape} for a signal of shape ({size},): mend or uninstall"
            " the package that offers it"
        )


def failure_of_others(error: BaseException) -> str:
    """The sentence that names the effect of another package in whose code ``error`` was raised; '' where there is none.

    Where the traceback holds no method of an effect (but one of its inverse, say), all effects of that package are
    named.
    """
    if not _offers.cache_info().currsize:
        return ""  # none was loaded, so none has failed
    frames = [frame for frame, _ in walk_tb(error.__traceback__)]
    rooms = {str(frame.f_globals.get("__name__")).partition(".")[0] for frame in frames} - {"smartshoe"}
    offers = _offers()[0].values()
    surely = [one.origin for one in offers if any(frame.f_locals.get("self") is one.effect for frame in frames)]
    maybe = [one.origin for one in offers if type(one.effect).__module__.partition(".")[0] in rooms]
    blamed = " or ".join(surely or maybe)
    why = f"{type(error).__name__}: {error}"
    return blamed and f"{blamed} fails ({why}): mend or uninstall the package"


@cache
def catalogue() -> Mapping[str, Effect]:
    """Effects that may be named as a cause, by name, in the order of the names."""
    return MappingProxyType({name: one for name, one in _found().items() if not one.is_flexible})


@cache
def blocks() -> Mapping[str, tuple[Effect, ...]]:
    """The flexible blocks by family: each follows any law of its family, or what no law does; never named as causes."""
    flexible = [one for one in _found().values() if one.is_flexible]
    families = sorted({one.family for one in flexible})
    return MappingProxyType({name: tuple(one for one in flexible if one.family == name) for name in families})


def in_words(name: str) -> str:
    """What a person calls an effect, or another identifier; a flexible block is one "of free form"."""
    found = _named(name)
    said = f"{name.removeprefix('flexible_')} of free form" if found is not None and found.is_flexible else name
    return said.replace("_", " ")


def listed(names: Iterable[str], last: str = "") -> str:
    """What a person calls effects, one after the other: "a, b, c", or with a word before the ``last``: "a, b or c"."""
    said = [in_words(name) for name in names]
    return f"{', '.join(said[:-1])} {last} {said[-1]}" if last and len(said) > 1 else ", ".join(said)


def effect(name: str) -> Effect:
    """The effect or flexible block called ``name``; raises `UsageError` with the names there are."""
    found = _named(name)
    if found is None:
        raise UsageError(f"there is no effect {name!r}: use one of {', '.join(_found())}")
    return found


def why_not_known(name: str) -> str:
    """Half a sentence where no effect is called ``name``: '' where there is one."""
    if _named(name) is not None:
        return ""
    broken = _offers()[1]
    return str(broken[0]) if broken else "no package that is installed offers it"


def shift_of(signal: Literal["load", "reading"]) -> Effect:
    """The effect that adds one value to the "load" or to the "reading"."""
    return next(one for one in _own().values() if one.shifts == signal)


def between_clocks(what: Literal["lag", "rate"]) -> Effect:
    """The effect whose one value is the "lag" of one clock behind another, or how their "rate" differs."""
    return next(one for one in _own().values() if one.between_clocks == what)


def told_apart_by(one: Effect, other: Effect) -> frozenset[Exposure]:
    """What tells the two apart, any of these words; either effect may say it of the other."""
    return one.separated_by.get(other.name, frozenset()) | other.separated_by.get(one.name, frozenset())


@cache
def is_told_from_its_family(one: Effect, present: frozenset[str]) -> bool:
    """Whether what is ``present`` in the data tells the branch of an effect from the others of its family."""
    family = [law for law in catalogue().values() if law.kind == one.kind]
    own, others = ([law for law in family if (law.branch == one.branch) is alike] for alike in (True, False))
    return any(told_apart_by(law, other) & present for law in own for other in others)
