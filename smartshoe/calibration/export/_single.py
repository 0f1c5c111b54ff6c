"""Translates the C code of an extended model's blocks to single precision."""

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
    """``step`` with every double as float, every constant rounded once, and compensated running sums.

    A sum over a session grows while its increments do not. Therefore the rounding error of each addition is added back
    at the next (Kahan 1965): each ``f->member += ...;`` gets a second member for it.
    """
    summed = [name for name in dict.fromkeys(match[1] for match in _SUM.finditer(step.body)) if name in step.states]
    body = _SUM.sub(lambda match: _carried(match[1], match[2]) if match[1] in summed else match[0], step.body)
    return CStep({**step.states, **{name + _CARRY: 0.0 for name in summed}}, single_text(body))


def single_text(text: str) -> str:
    """C text with float in place of double: types, constants, library functions."""
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
