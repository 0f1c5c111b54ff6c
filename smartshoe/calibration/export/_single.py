"""C of the blocks of an extended model turned into single precision."""

from __future__ import annotations

import re

import numpy as np

from smartshoe.calibration.export._cost import FUNCTIONS
from smartshoe.models.effects.effect import CStep

_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][-+]?\d+)?(?![\w.])")
_FUNCTION = re.compile(rf"\b({FUNCTIONS})\(")
_SUM = re.compile(r"f->(\w+) \+= (.+?);", re.DOTALL)
_CARRY = "_carry"


def in_single(step: CStep) -> CStep:
    """``step`` with every double a float, every constant rounded once, and running sums carried.

    A sum over a session grows while its increments do not: what each addition rounds away is given back with the
    next (Kahan 1965), so that ``f->member += ...;`` gets a member beside it.
    """
    summed = [name for name in dict.fromkeys(match[1] for match in _SUM.finditer(step.body)) if name in step.states]
    body = _SUM.sub(lambda match: _carried(match[1], match[2]) if match[1] in summed else match[0], step.body)
    return CStep({**step.states, **{name + _CARRY: 0.0 for name in summed}}, single_text(body))


def single_text(text: str) -> str:
    """C text with float in place of double: types, constants, functions of the library."""
    text = re.sub(r"\bdouble\b", "float", text)
    text = _FUNCTION.sub(r"\1f(", text)
    return _NUMBER.sub(lambda match: f"{np.float32(match[0])!s}f", text)


def _carried(name: str, increment: str) -> str:
    return f"""{{
        const double wanted = {increment} + f->{name}{_CARRY};
        const double held = f->{name};
        f->{name} = held + wanted;
        f->{name}{_CARRY} = wanted - (f->{name} - held);
    }}"""
