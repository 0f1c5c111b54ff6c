"""Translates the C code of an extended model's blocks to integers: every double becomes a 64-bit count of 2^-fraction.

The blocks are written in a small subset of C (declarations, assignments, if, for, while, break, calls of <math.h>). It
is parsed and rewritten: sums stay sums, products and quotients become calls of `INTEGER_FUNCTIONS`. Each expression
carries a bound on its size, so that no sum exceeds 64 bits: one that could is first limited to `MOST`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from smartshoe.calibration.export._integer_functions import MOST, REAL_FUNCTIONS
from smartshoe.models.effects.effect import CStep

_ROOM = 2**62  # a smaller sum stays within 64 bits after half a step of rounding
_TOKEN = re.compile(
    r"(?:\s|/\*.*?\*/)*(?:(?P<real>(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+)|(?P<whole>\d+)|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign>->|\+\+|\+=|-=|\*=|/=|<=|>=|==|!=|&&|\|\||[-+*/<>=!?:;,(){}\[\]]))"
)
_LEVELS = (("||",), ("&&",), ("==", "!=", "<", ">", "<=", ">="), ("+", "-"), ("*", "/"))


@dataclass(frozen=True)
class _Term:
    """C text of an expression: ``real`` where it counts 2^-fraction, ``size`` its largest magnitude in counts.

    ``value`` is that of a constant before scaling, else None. ``tight`` text needs no brackets.
    """

    text: str
    real: bool
    size: int = 0
    value: Fraction | None = None
    tight: bool = True

    @property
    def closed(self) -> str:
        return self.text if self.tight else f"({self.text})"


@dataclass
class IntegerC:
    """Translates steps to integers; ``used`` collects the functions that the texts call."""

    fraction: int
    used: set[str] = field(default_factory=set)

    @property
    def one(self) -> int:
        """The number of counts that represents 1."""
        return int(2**self.fraction)

    def step(self, step: CStep) -> CStep:
        """``step`` with counts in place of doubles, states included."""
        body = _Parser(step.body, self).everything()
        return CStep({name: self.count(Fraction(value)) for name, value in step.states.items()}, body)

    def count(self, value: Fraction) -> int:
        """``value`` rounded to counts, limited to `MOST`."""
        return max(-MOST, min(MOST, round(value * self.one)))

    def literal(self, value: Fraction) -> _Term:
        """The term of a constant."""
        count = self.count(value)
        return _Term(f"INT64_C({count})" if count >= 0 else f"(-INT64_C({-count}))", True, abs(count), value)

    def call(self, function: str, *arguments: str) -> str:
        """The text of a call of an integer function, which is added to ``used``."""
        self.used.add(function)
        return f"{function}({', '.join(arguments)})"

    def held(self, term: _Term, within: int = MOST) -> _Term:
        """``term`` limited to magnitudes up to ``within``."""
        if term.size <= within:
            return term
        return _Term(self.call("held_q", term.text), True, MOST)


class _Parser:
    def __init__(self, text: str, to: IntegerC) -> None:
        self.tokens = list(_tokens(text))
        self.at = 0
        self.to = to
        self.integers: set[str] = set()

    # Tokens

    def _next(self) -> tuple[str, str]:
        if self.at == len(self.tokens):
            raise ValueError("it ends in the middle of a statement")
        self.at += 1
        return self.tokens[self.at - 1]

    def _sees(self, *texts: str) -> bool:
        return self.at < len(self.tokens) and self.tokens[self.at][1] in texts

    def _takes(self, text: str) -> bool:
        found = self._sees(text)
        self.at += found
        return found

    def _needs(self, text: str) -> None:
        if not self._takes(text):
            raise ValueError(f"expected {text!r} at {' '.join(t for _, t in self.tokens[self.at : self.at + 8])!r}")

    # Statements

    def everything(self) -> str:
        lines: list[str] = []
        while self.at < len(self.tokens):
            lines += self._statement()
        return "\n".join(lines)

    def _block(self) -> list[str]:
        self._needs("{")
        lines: list[str] = []
        while not self._takes("}"):
            lines += [f"    {line}" for line in self._statement()]
        return lines

    def _statement(self) -> list[str]:
        if self._sees("{"):
            return ["{", *self._block(), "}"]
        if self._takes("if"):
            return self._if()
        for loop in ("for", "while"):
            if self._takes(loop):
                head = self._for_head() if loop == "for" else self._bracketed().text
                return [f"{loop} ({head}) {{", *self._block(), "}"]
        if self._sees("static", "const", "double", "int"):
            return self._declaration()
        line = self._next()[1] if self._sees("break", "continue") else self._assignment()
        self._needs(";")
        return [f"{line};"]

    def _if(self) -> list[str]:
        lines = [f"if ({self._bracketed().text}) {{", *self._block()]
        while self._takes("else"):
            if self._takes("if"):
                lines += [f"}} else if ({self._bracketed().text}) {{", *self._block()]
            else:
                lines += ["} else {", *self._block()]
        return [*lines, "}"]

    def _for_head(self) -> str:
        self._needs("(")
        first = self._assignment()
        self._needs(";")
        condition = self._expression().text
        self._needs(";")
        last = self._assignment()
        self._needs(")")
        return f"{first}; {condition}; {last}"

    def _bracketed(self) -> _Term:
        self._needs("(")
        found = self._expression()
        self._needs(")")
        return found

    def _declaration(self) -> list[str]:
        words = []
        while self._sees("static", "const", "double", "int"):
            words.append(self._next()[1])
        real = words[-1] == "double"
        names = []
        while True:
            name = self._next()[1]
            (self.integers.discard if real else self.integers.add)(name)
            size = ""
            if self._takes("["):
                size = f"[{self._next()[1]}]"
                self._needs("]")
            names.append(name + size + (f" = {self._initial(real)}" if self._takes("=") else ""))
            if not self._takes(","):
                break
        self._needs(";")
        words[-1] = "int64_t" if real else "int"
        return [f"{' '.join(words)} {', '.join(names)};"]

    def _initial(self, real: bool) -> str:
        if not self._takes("{"):
            return self._given(self._expression(), real)
        values = []
        while not self._takes("}"):
            values.append(self._given(self._expression(), real))
            self._takes(",")
        return "{" + ", ".join(values) + "}"

    def _given(self, term: _Term, real: bool) -> str:
        """The text of a value to be stored, limited so that a variable never exceeds `MOST`."""
        return self.to.held(self._real(term)).text if real else term.text

    def _assignment(self) -> str:
        target = self._postfix()
        if self._takes("++"):
            return f"{target.text}++"
        sign = self._next()[1]
        right = self._expression()
        if sign != "=":
            right = self._joined(sign[0], target, right)
        return f"{target.text} = {self._given(right, target.real)}"

    # Expressions

    def _expression(self) -> _Term:
        condition = self._level(0)
        if not self._takes("?"):
            return condition
        one = self._expression()
        self._needs(":")
        other = self._expression()
        if one.real or other.real:
            one, other = self._real(one), self._real(other)
        text = f"{condition.closed} ? {one.closed} : {other.closed}"
        return _Term(text, one.real, max(one.size, other.size), None, tight=False)

    def _level(self, level: int) -> _Term:
        if level == len(_LEVELS):
            return self._unary()
        left = self._level(level + 1)
        while self._sees(*_LEVELS[level]):
            sign = self._next()[1]
            left = self._joined(sign, left, self._level(level + 1))
        return left

    def _joined(self, sign: str, left: _Term, right: _Term) -> _Term:
        if sign in ("&&", "||"):
            return _Term(f"{left.closed} {sign} {right.closed}", False, tight=False)
        if not (left.real or right.real):
            return _Term(f"{left.closed} {sign} {right.closed}", False, tight=False)
        left, right = self._real(left), self._real(right)
        if sign in ("+", "-"):
            return self._sum(sign, left, right)
        if sign == "*":
            return self._product(left, right)
        if sign == "/":
            return self._quotient(left, right)
        return _Term(f"{left.closed} {sign} {right.closed}", False, tight=False)

    def _real(self, term: _Term) -> _Term:
        if term.real:
            return term
        if term.value is not None:
            return self.to.literal(term.value)
        # An index into a table is far below the limit of the counts.
        return _Term(f"(int64_t){term.closed} * INT64_C({self.to.one})", True, MOST, None, tight=False)

    def _sum(self, sign: str, left: _Term, right: _Term) -> _Term:
        if left.value is not None and right.value is not None:
            return self.to.literal(left.value + right.value if sign == "+" else left.value - right.value)
        if left.size + right.size > _ROOM:
            left, right = self.to.held(left), self.to.held(right)
        return _Term(f"{left.text} {sign} {right.closed}", True, left.size + right.size, None, tight=False)

    def _product(self, left: _Term, right: _Term) -> _Term:
        if left.value is not None and right.value is not None:
            return self.to.literal(left.value * right.value)
        if left.value is not None:
            left, right = right, left
        left, right = self.to.held(left), self.to.held(right)
        if right.value == 1:
            return left
        if right.value == Fraction(1, 2):
            return _Term(self.to.call("rounded_q", left.text, "1"), True, left.size // 2 + 1)
        if right.value == 2:
            return _Term(f"2 * {left.closed}", True, 2 * left.size, None, tight=False)
        return _Term(self.to.call("times_q", left.text, right.text), True, MOST)

    def _quotient(self, left: _Term, right: _Term) -> _Term:
        if right.value is not None and right.value != 0:
            return self._product(left, self.to.literal(1 / right.value))
        return _Term(self.to.call("over_q", self.to.held(left).text, self.to.held(right).text), True, MOST)

    def _unary(self) -> _Term:
        if self._takes("-"):
            term = self._unary()
            if not term.real:
                return _Term(f"-{term.closed}", False, 0, None if term.value is None else -term.value, tight=False)
            return self.to.literal(-term.value) if term.value is not None else _Term(
                f"-{term.closed}", True, term.size, None, tight=False
            )  # fmt: skip
        if self._takes("!"):
            return _Term(f"!{self._unary().closed}", False)
        return self._postfix()

    def _postfix(self) -> _Term:
        kind, text = self._next()
        if kind == "real":
            return self.to.literal(Fraction(text))
        if kind == "whole":
            return _Term(text, False, 0, Fraction(text))
        if text == "(":
            return self._cast_or_bracket()
        if text == "f" and self._takes("->"):
            return _Term(f"f->{self._next()[1]}", True, MOST)
        if self._takes("("):
            return self._call(text)
        if self._takes("["):
            index = self._expression()
            self._needs("]")
            return _Term(f"{text}[{index.text}]", True, MOST)
        return _Term(text, text not in self.integers, MOST)

    def _cast_or_bracket(self) -> _Term:
        if self._sees("int", "double"):
            kind = self._next()[1]
            self._needs(")")
            term = self._unary()
            if kind == "double":
                return self._real(term)
            return _Term(f"(int)({self.to.held(self._real(term)).closed} / INT64_C({self.to.one}))", False)
        found = self._expression()
        self._needs(")")
        if found.value is not None:
            return found
        return _Term(found.closed, found.real, found.size, found.value)

    def _call(self, name: str) -> _Term:
        if name not in REAL_FUNCTIONS:
            raise ValueError(f"{name} has no integer twin")
        arguments = []
        while not self._takes(")"):
            arguments.append(self.to.held(self._real(self._expression())).text)
            self._takes(",")
        return _Term(self.to.call(f"{name}_q", *arguments), True, MOST)


def _tokens(text: str) -> Iterator[tuple[str, str]]:
    text = text.rstrip()
    at = 0
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None or found.lastgroup is None:
            raise ValueError(f"no C that is known: {text[at : at + 40]!r}")
        yield found.lastgroup, found[found.lastgroup]
        at = found.end()
