"""Small bugs, one at a time: every place of a source file where one can be put in, and the file's text with it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, replace

_SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult, ast.Pow: ast.Mult, ast.MatMult: ast.Add, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.BitXor: ast.BitAnd, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
_HAS_OTHERS = (ast.Compare, ast.BoolOp, ast.UnaryOp)  # a condition that is changed in another way
# What a person reads, and what stands for a fault that is found already.
_LEFT_ALONE = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)
_FIELDS_LEFT_ALONE = frozenset({"annotation", "returns", "decorator_list", "bases", "type_params"})
_WORDS_LEFT_ALONE = frozenset({"strict", "stacklevel"})  # of a call: they only tell of faults in the code
_AROUND = 40  # letters of a statement that are shown on either side of a change


@dataclass(frozen=True, slots=True)
class Change:
    """One small bug, the ``number``-th of its file: its lines, what stood there and what takes its place.

    ``line`` to ``last`` are those of the statement, without the statements in its blocks.
    """

    number: int
    line: int
    last: int
    before: str
    after: str

    def __str__(self) -> str:
        return f"`{self.before}` → `{self.after}`"


@dataclass(slots=True)
class _Place:
    """One thing in the tree that may be another: swapped in, and swapped out again."""

    statement: ast.stmt
    holder: ast.AST
    field: str
    index: int | None
    other: object

    def swap(self) -> None:
        if self.index is None:
            here = getattr(self.holder, self.field)
            setattr(self.holder, self.field, self.other)
        else:
            items = getattr(self.holder, self.field)
            here, items[self.index] = items[self.index], self.other
        self.other = here


def changes(text: str) -> list[Change]:
    """Every small bug that the source ``text`` may have, in the order of its lines.

    A bound that takes its edge in or leaves it out, `==` for `!=`, `+` for `-`, `*` for `/`, `and` for `or`, a
    condition turned round, an integer one more, another number doubled, a call left out whose value nobody takes
    (`os.fsync`), a value that is not returned. Messages, annotations and decorators are left alone.
    """
    found = []
    for number, place in enumerate(_places(ast.parse(text))):
        before = ast.unparse(place.statement).split("\n")
        place.swap()
        after = ast.unparse(place.statement).split("\n")
        place.swap()
        old, new = next(pair for pair in zip(before, after, strict=True) if pair[0] != pair[1])
        said = _shortened(old.strip(), new.strip())
        found.append(Change(number, place.statement.lineno, _last_line(place.statement), *said))
    return found


def _last_line(statement: ast.stmt) -> int:
    """The last line of a statement that is not one of its blocks'."""
    blocks = [getattr(statement, name, None) for name in ("body", "cases")]
    inner = [block[0] for block in blocks if isinstance(block, list) and block]
    if not inner:
        return statement.end_lineno or statement.lineno
    first = inner[0].pattern if isinstance(inner[0], ast.match_case) else inner[0]
    return max(statement.lineno, first.lineno - 1)


def _shortened(old: str, new: str) -> tuple[str, str]:
    """Both without what they share, but for some letters on either side."""
    start = next(k for k in range(len(old) + 1) if old[: k + 1] != new[: k + 1])
    shared = min(len(old), len(new)) - start
    stop = next((k for k in range(shared) if old[-1 - k] != new[-1 - k]), shared)
    first = max(0, start - _AROUND)

    def cut(text: str) -> str:
        last = len(text) - max(0, stop - _AROUND)
        return f"{'…' if first else ''}{text[first:last]}{'…' if last < len(text) else ''}"

    return cut(old), cut(new)


def changed(text: str, number: int) -> ast.Module:
    """The source ``text`` with the ``number``-th of its `changes` made; its lines are numbered as they were."""
    tree = ast.parse(text)
    _places(tree)[number].swap()
    return ast.fix_missing_locations(tree)


def _places(tree: ast.Module) -> list[_Place]:
    return [place for item in tree.body for place in _of_statement(item)]


def _of_statement(statement: ast.stmt) -> Iterator[_Place]:
    """The places of a statement and of those in its blocks."""
    if isinstance(statement, _LEFT_ALONE) or _is_never_run(statement):
        return
    for field, other in _instead_of_statement(statement):
        yield _Place(statement, statement, field, None, other)
    for holder, field, index, item in _parts(statement):
        yield from _of_part(item, _Place(statement, holder, field, index, None))


def _instead_of_statement(statement: ast.stmt) -> Iterator[tuple[str, ast.AST]]:
    """Fields of a statement, and what may stand there."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        yield "value", ast.Constant(None)
    elif isinstance(statement, ast.Return) and statement.value is not None:
        if not (isinstance(statement.value, ast.Constant) and statement.value.value is None):
            yield "value", ast.Constant(None)
    elif isinstance(statement, ast.If) and not isinstance(statement.test, _HAS_OTHERS):
        yield "test", ast.UnaryOp(ast.Not(), statement.test)


def _parts(node: ast.AST) -> Iterator[tuple[ast.AST, str, int | None, object]]:
    """What a node holds: itself, the field, the place in it where it is a list, and what stands there."""
    for field, value in ast.iter_fields(node):
        if field not in _FIELDS_LEFT_ALONE:
            for index, item in enumerate(value) if isinstance(value, list) else [(None, value)]:
                yield node, field, index, item


def _of_part(item: object, place: _Place) -> Iterator[_Place]:
    if isinstance(item, ast.stmt):
        yield from _of_statement(item)
    elif isinstance(item, ast.AST) and not isinstance(item, _LEFT_ALONE):
        if isinstance(item, ast.keyword) and item.arg in _WORDS_LEFT_ALONE:
            return
        for other in _others(item):
            yield replace(place, other=other)
        for holder, field, index, inner in _parts(item):
            yield from _of_part(inner, replace(place, holder=holder, field=field, index=index))


def _others(item: ast.AST) -> Iterator[ast.AST]:
    """What may stand in the place of an expression or an operator."""
    if type(item) in _SWAPPED:
        yield _SWAPPED[type(item)]()
    elif isinstance(item, ast.UnaryOp) and not isinstance(item.op, ast.UAdd):
        if not isinstance(item.operand, ast.Constant):
            yield item.operand
    elif isinstance(item, ast.IfExp) and not isinstance(item.test, _HAS_OTHERS):
        yield ast.IfExp(ast.UnaryOp(ast.Not(), item.test), item.body, item.orelse)
    elif isinstance(item, ast.Constant):
        if isinstance(item.value, bool):
            yield ast.Constant(not item.value)
        elif isinstance(item.value, int):
            yield ast.Constant(item.value + 1)
        elif isinstance(item.value, float):
            yield ast.Constant(2 * item.value or 1.0)


def _is_never_run(statement: ast.stmt) -> bool:
    """Code for readers of types alone: `if TYPE_CHECKING`, overloads, abstract bodies."""
    if isinstance(statement, ast.If):
        return isinstance(statement.test, ast.Name) and statement.test.id == "TYPE_CHECKING"
    decorators = getattr(statement, "decorator_list", ())
    return bool({ast.unparse(item) for item in decorators} & {"overload", "abstractmethod"})
