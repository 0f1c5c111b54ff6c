"""The checks of an effect that another package offers: a faulty one is refused at once, with the package's name.

They run such an effect a few times at each start. The effects of this package are held to the same by tests.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.models.effects._sensor_evidence import NoiseEffect, SensorEvidence
from smartshoe.models.effects._sensor_inverse import Memoryless
from smartshoe.models.effects.effect import (
    PLACES,
    ChainContext,
    Conditions,
    CoreEffect,
    Effect,
    EffectParameter,
    Inverse,
)
from smartshoe.models.effects.exposure import CHANNELS, WORDS
from smartshoe.models.elements import Arm

REQUIRED = ("name", "family", "stage", "place", "says", "parameters")
SHORT, LONG = (32, 0.02), (3000, 0.01)  # samples of a trial signal, and the step between them in s
RELAXING = (0.06, 0.2)
IDENTITY = 1e-9  # of full scale: an effect at null differs less from its input, an inverse less on a cut stream


def refuse_faulty(offered: Effect, origin: str) -> None:
    """Raises `UsageError` with the first fault of an ``offered`` effect; ``origin`` names who offers it."""
    at = ""
    try:
        wrong = next(_wrongs(offered), "")
        if wrong:
            raise UsageError(f"{origin} {wrong}: mend the package")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what comes of a warning is judged by the numbers
            for shape in offered.shapes:
                at = "".join(f" at {name} = {value:g}" for name, value in shape.items())
                _try(offered, shape)
    except UsageError:
        raise
    except (Exception, SystemExit) as error:  # whatever another package does
        raise UsageError(
            f"{origin} fails{at} ({type(error).__name__}: {error}): mend or uninstall the package"
        ) from error


def _wrongs(offered: Effect) -> Iterator[str]:
    """The faults of what the effect declares, each as the end of a sentence."""
    missing = [word for word in REQUIRED if not hasattr(offered, word)]
    if missing:
        yield f"has no {', no '.join(missing)}"
    yield from _wrong_kinds(offered)
    yield from _wrong_words(offered)
    if not isinstance(offered.parameters, tuple) or not all(isinstance(p, EffectParameter) for p in offered.parameters):
        yield f"has the parameters {offered.parameters!r}, which are no tuple of EffectParameter"
    for parameter in offered.parameters:
        yield from (f"has a parameter {parameter.name!r} {wrong}" for wrong in _wrong_numbers(parameter))
    names = [parameter.name for parameter in offered.parameters]
    yield from (f"has two parameters of the name {name!r}" for name in names if names.count(name) > 1)
    if offered.is_physical and all(parameter.null is None for parameter in offered.parameters):
        yield "has no parameter with a null value, and so no strength that could be fitted"
    yield from _wrong_shapes(offered)


def _wrong_kinds(offered: Effect) -> Iterator[str]:
    """Faults of its class, its name, its place and its traits."""
    for word in ("name", "family", "stage", "says"):
        value = getattr(offered, word)
        if not isinstance(value, str) or not value or not value.isprintable():
            yield f"has the {word} {value!r}, which is no text"
    if not _is_identifier(offered.name):
        yield f"has the name {offered.name!r}, which is no word of letters, digits and underscores"
    if offered.place not in PLACES:
        yield f"has the place {offered.place!r}, which is none of {', '.join(PLACES)}"
    if (offered.place == "core") != isinstance(offered, CoreEffect):
        place = f"is a {type(offered).__name__} at the place {offered.place!r}"
        yield f"{place}, but CoreEffects, and no others, are at 'core'"
    for word, usual in vars(Effect).items():
        if isinstance(usual, bool | str) and not word.startswith("_"):
            value = getattr(offered, word)
            if not isinstance(value, type(usual)):
                yield f"has {word} = {value!r}, which is no {type(usual).__name__}"
    for word in ("shifts", "between_clocks"):
        if getattr(offered, word) is not None:
            yield f"has {word} = {getattr(offered, word)!r}, which effects of smartshoe alone may say"


def _wrong_words(offered: Effect) -> Iterator[str]:
    """Faults of the words for what shows it and what tells it from others."""
    if not isinstance(offered.separated_by, Mapping):
        yield f"has separated_by = {offered.separated_by!r}, which is no mapping of an effect's name to words"
    asked = {"exposed_by": offered.exposed_by, "needs": offered.needs}
    asked |= {f"separated_by[{name!r}]": words for name, words in offered.separated_by.items()}
    for where, words in asked.items():
        if not isinstance(words, frozenset | set):
            yield f"has {where} = {words!r}, which is no set of words as by(...) gives"
        known = CHANNELS if where == "needs" else WORDS
        unknown = ", ".join(sorted(map(str, words - known)))
        if unknown:
            yield f"is shown by {unknown}, which is not known: {where} may hold {', '.join(sorted(known))}"


def _wrong_numbers(one: EffectParameter) -> Iterator[str]:
    """Faults of one parameter."""
    if not _is_identifier(one.name):
        yield "whose name is no word of letters, digits and underscores"
    if not (isinstance(one.unit, str) and isinstance(one.says, str)):
        yield "whose unit or says is no text"
    if not all(map(_is_number, (one.lower, one.upper, one.size))):
        yield f"with the bounds {one.lower!r} and {one.upper!r} and the size {one.size!r}, not all finite numbers"
    if not one.lower < one.upper:
        yield f"whose lower bound {one.lower:g} is not below its upper one, {one.upper:g}"
    if not one.size > 0.0:
        yield f"of size {one.size:g}, which must be above 0"
    if one.null is not None and not (_is_number(one.null) and one.lower <= one.null <= one.upper):
        yield f"whose null value {one.null!r} is not within its bounds, {one.lower:g} to {one.upper:g}"
    if one.channel and one.channel not in CHANNELS:
        yield f"of the channel {one.channel!r}, which is none of {', '.join(sorted(CHANNELS))}"


def _wrong_shapes(offered: Effect) -> Iterator[str]:
    """Faults of the grid over its shape parameters."""
    if not (
        isinstance(offered.shapes, tuple) and offered.shapes and all(isinstance(s, Mapping) for s in offered.shapes)
    ):
        yield f"has shapes = {offered.shapes!r}, no tuple of one mapping or more, and so would never be tried"
    free = {parameter.name: parameter for parameter in offered.parameters if parameter.null is None}
    for shape in offered.shapes:
        for name, value in shape.items():
            if name not in free:
                yield f"has a shape of {name!r}, which is no parameter of it without a null value"
            if not (_is_number(value) and free[name].lower <= value <= free[name].upper):
                yield f"has a shape of {name} = {value!r}, which is not within its bounds"
        missing = free.keys() - offered.shapes[0].keys() - shape.keys()
        if missing:
            yield f"has a shape in which parameter {min(missing)} has no value"


def _is_identifier(name: Any) -> bool:
    return isinstance(name, str) and name.isascii() and name.isidentifier()


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value)


def _conditions(count: int, step_s: float, *, logged: bool) -> Conditions:
    """Triangles of the load, of some seconds each, with all channels that may be ``logged``, or none."""
    turns = np.linspace(0.0, max(2.0, count * step_s / 5.0), count)
    load = 1.0 - np.abs(turns % 2.0 - 1.0)
    load.flags.writeable = False  # an effect that writes to its input would spoil that of others
    channels = (np.linspace(0.0, 3.0, count), 0.5 * load, RELAXING) if logged else (None, None, None)
    temperature_k, neighbour, relaxing = channels
    time_s: Array = step_s * np.arange(count, dtype=float)
    return Conditions(time_s, load, step_s, temperature_k=temperature_k, neighbour=neighbour, relaxing=relaxing)


def _try(offered: Effect, shape: Mapping[str, float]) -> None:
    """Runs it at one of its shapes; raises what it raises, or `TypeError` or `ValueError` for a wrong result.

    1. At null strengths it must be the identity; asked twice, it must give the same.
    2. Its inverse, if any, must not depend on how the stream is cut (`_try_inverse`).
    3. An effect of noise must give evidence of the right type.
    """
    null, begun = offered.start(shape), offered.begun(shape, logged=CHANNELS)
    for at in (_conditions(*SHORT, logged=False), _conditions(*SHORT, logged=True)):
        at_null = _checked(offered.apply(at.load, at, null), at.load.size, "apply")
        largest = float(np.max(np.abs(at_null - at.load)))
        if largest > IDENTITY:
            raise ValueError(f"at its null values apply is not the identity, but {largest:.2g} of full scale away")
        first, again = (_checked(offered.apply(at.load, at, begun), at.load.size, "apply") for _ in range(2))
        if not np.array_equal(first, again):
            raise ValueError("apply gives other numbers when it is asked the same again")
    long = _conditions(*LONG, logged=True)
    output = _checked(offered.apply(long.load, long, begun), long.load.size, "apply")
    if offered.is_physical:
        _try_inverse(offered, begun, at, first)
        _try_inverse(offered, begun, long, output)
    if isinstance(offered, NoiseEffect):
        residual = np.random.default_rng(1).normal(0.0, 1e-3, long.load.size)
        found = offered.evidence(residual, long, long.load)
        if not isinstance(found, SensorEvidence | None):
            raise TypeError(f"evidence gives {found!r}, which is neither a SensorEvidence nor None")


def _try_inverse(offered: Effect, values: Array, at: Conditions, output: Array) -> None:
    """Undoes the effect's ``output`` (n,), whole and, if it is short, in two pieces."""
    undone = offered.inverse_within(ChainContext(Arm(*RELAXING)), values, at.step_s)
    if undone is None:
        return
    if not isinstance(undone, Inverse):
        raise TypeError(f"inverse gives {undone!r}, which is neither an Inverse nor None")
    if offered.is_drift and not isinstance(undone, Memoryless):
        raise TypeError("is_drift needs a Memoryless inverse, which can be held where nothing tells how it goes on")

    def pushed(part: slice) -> Array:
        signal = output[part].copy()
        return _checked(undone.push(signal, at.time_s[part].copy()), signal.size, "the inverse's push")

    whole = pushed(slice(None))
    if output.size > SHORT[0]:
        return
    undone.reset()
    if not np.allclose(whole, [*pushed(slice(0, 1)), *pushed(slice(1, None))], rtol=0.0, atol=IDENTITY):
        raise ValueError("the inverse gives other numbers where the stream is cut")


def _checked(found: Any, size: int, what: str) -> Array:
    """``found`` where it is a finite array (``size``,) of float64; else raises. ``what`` is its name in the message."""
    shape = np.shape(found)
    if shape != (size,):
        raise ValueError(f"{what} gives values of shape {shape} for a signal of shape ({size},)")
    if not isinstance(found, np.ndarray) or found.dtype != np.float64:
        kind = found.dtype if isinstance(found, np.ndarray) else type(found).__name__
        raise TypeError(f"{what} gives {kind}, no array of float64")
    if not np.isfinite(found).all():
        raise ValueError(f"{what} gives values that are no finite numbers")
    return found
