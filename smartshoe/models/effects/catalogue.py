"""Every effect, found from the modules of this folder: to add one is to add its file."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from smartshoe.errors import UsageError
from smartshoe.models import effects
from smartshoe.models.effects.effect import Effect


def _concrete(kind: Any) -> list[type[Effect]]:
    below = [leaf for child in kind.__subclasses__() for leaf in _concrete(child)]
    return below if getattr(kind, "__abstractmethods__", None) else [kind, *below]


@cache
def _found() -> Mapping[str, Effect]:
    for module in pkgutil.iter_modules(effects.__path__):
        importlib.import_module(f"{effects.__name__}.{module.name}")
    own = [kind for kind in _concrete(Effect) if kind.__module__.startswith(effects.__name__)]
    return MappingProxyType({made.name: made for made in sorted((kind() for kind in own), key=lambda one: one.name)})


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


def effect(name: str) -> Effect:
    """The effect or flexible block called ``name``; raises `UsageError` with the names there are."""
    found = _found().get(name)
    if found is None:
        raise UsageError(f"there is no effect {name!r}: use one of {', '.join(_found())}")
    return found
