"""Memory and operations of exported C code, counted in the generated text itself."""

from __future__ import annotations

import re
from collections import Counter

_SIZES = {"double": 8, "float": 4, "int": 4, "int64_t": 8, "int32_t": 4, "uint32_t": 4, "int16_t": 2}
_TYPES = "|".join(_SIZES)
_TABLE = re.compile(rf"static const ({_TYPES}) \w+\[(\d+)\] = \{{[^}}]*\}};")
_CONSTANT = re.compile(rf"static const ({_TYPES}) \w+ = [^;]*;")
_LOOP = re.compile(r"for \(\w+ = 0; \w+ (<=?) (\d+); \w+\+\+\) \{")
_TOKEN = re.compile(rf"{_LOOP.pattern}|->|\+\+|--|[<>=!]=|<<|>>|&&|\|\||\w+\(|[-+*/{{}}<>]|[\d.]+(?:[eE][-+]?\d+)?")
_KINDS = {
    "+": "additions",
    "-": "additions",
    "*": "multiplications",
    "/": "divisions",
    "<": "comparisons",
    ">": "comparisons",
    "<=": "comparisons",
    ">=": "comparisons",
    ">>": "shifts",
    "<<": "shifts",
}
FUNCTIONS = (
    "exp|exp2|expm1|log|log2|log1p|pow|sqrt|cbrt|hypot|sin|cos|tan|asin|acos|atan|sinh|cosh|tanh|asinh|acosh|atanh"
    "|fabs|fmax|fmin|fmod|floor|ceil"
)
"""Functions of <math.h> that blocks may call; each has a twin of the same name and an f for floats."""
_CALLS = re.compile(rf"(?:{FUNCTIONS})f?\(")


def state_bytes(header: str) -> int:
    """Size in bytes of the struct in ``header``, including the padding of natural alignment."""
    (body,) = re.findall(r"typedef struct \w+ \{(.*?)\} \w+;", header, re.DOTALL)
    sizes = [_SIZES[kind] for kind in re.findall(rf"^ *({_TYPES}) \w+;", body, re.MULTILINE)]
    at = 0
    for size in sizes:
        at += -at % size + size
    return at + -at % max(sizes)


def table_bytes(source: str) -> int:
    """Size in bytes of the constant tables in ``source``."""
    return sum(_SIZES[kind] * int(count) for kind, count in _TABLE.findall(source))


def operations(source: str) -> Counter[str]:
    """Number of operations by kind of one push in the worst case: every branch taken, every loop to its end.

    All functions of ``source`` except its init run once per push, as the templates call them; a function called by
    another is counted at each call.
    """
    text = re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL)
    text = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
    text = _CONSTANT.sub("", _TABLE.sub("", text))
    bodies = dict(re.findall(r"(\w+)\([^()]*\)\n\{\n(.*?)\n\}", text, re.DOTALL))
    push = next(name for name in bodies if name.endswith("_push"))
    return _of(push, bodies)


def _of(name: str, bodies: dict[str, str]) -> Counter[str]:
    found: Counter[str] = Counter()
    times = [1]
    for match in _TOKEN.finditer(bodies[name]):
        token = match[0]
        if match[1]:
            times.append(times[-1] * (int(match[2]) + (match[1] == "<=")))
        elif token == "{":
            times.append(times[-1])
        elif token == "}":
            times.pop()
        elif token in _KINDS:
            found[_KINDS[token]] += times[-1]
        elif _CALLS.fullmatch(token):
            found["library calls"] += times[-1]
        elif token.endswith("(") and token[:-1] in bodies:
            for kind, count in _of(token[:-1], bodies).items():
                found[kind] += times[-1] * count
    return found


def cost_lines(header: str, source: str) -> dict[str, str]:
    """The header's statements about memory and operations, key to one line."""
    counted = operations(source)
    said = ", ".join(f"{counted[kind]} {kind}" for kind in dict.fromkeys((*_KINDS.values(), "library calls"))
                     if counted[kind])  # fmt: skip
    return {
        "memory": f"{state_bytes(header)} bytes of state a filter, {table_bytes(source)} bytes of constant tables",
        "operations": f"a sample at most {said}",
    }
