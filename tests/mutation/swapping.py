"""A small bug put into functions that are loaded already, in place of their code."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator
from types import CodeType, FunctionType

Key = tuple[str, int]  # a function's qualified name and first line


class Loaded:
    """The functions of a checkout's files that are loaded in this process."""

    def __init__(self, below: str) -> None:
        self._functions: dict[str, dict[Key, list[FunctionType]]] = {}
        compiled = set()
        for item in gc.get_objects():
            if isinstance(item, FunctionType) and item.__code__.co_filename.startswith(below):
                code = item.__code__
                own = self._functions.setdefault(code.co_filename, {})
                own.setdefault((code.co_qualname, code.co_firstlineno), []).append(item)
            elif type(item).__name__ == "CPUDispatcher":
                compiled.add(id(item.py_func))
        self._compiled = compiled

    def is_swapped(self, path: str, text: str, bug: ast.Module) -> bool:
        """Put ``bug``, the tree of the source ``text`` of ``path`` with a bug in it, in the place of what is loaded.

        False where that is not enough: the bug is in what an import runs, or in what numba has compiled.
        """
        before, after = (dict(_codes(compile(source, path, "exec", dont_inherit=True))) for source in (text, bug))
        other = {key for key, code in after.items() if key in before and before[key] != code}
        live = self._functions.get(path, {})
        swapped = [(function, after[key]) for key in other for function in live.get(key, [])]
        inner = [key for key in other if not any(child in other for child, _ in _children(after[key]))]
        held = {key for key in live for key in [key, *(child for child, _ in _codes(before[key]))] if key in before}
        if not inner or any(key not in held for key in inner) or set(before) != set(after):
            return False
        if any(id(function) in self._compiled for function, _ in swapped):
            return False
        if any(len(function.__code__.co_freevars) != len(code.co_freevars) for function, code in swapped):
            return False
        for function, code in swapped:
            function.__code__ = code
        return True


def _key(code: CodeType) -> Key:
    return code.co_qualname, code.co_firstlineno


def _children(code: CodeType) -> Iterator[tuple[Key, CodeType]]:
    return ((_key(item), item) for item in code.co_consts if isinstance(item, CodeType))


def _codes(code: CodeType) -> Iterator[tuple[Key, CodeType]]:
    """A code and those within it."""
    yield _key(code), code
    for _, inner in _children(code):
        yield from _codes(inner)
