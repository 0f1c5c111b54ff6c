"""What keeps the house easy to find one's way in: one class a name, and imports that never come back."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@cache
def _modules() -> dict[str, tuple[ast.Module, bool]]:
    """Each module's tree, and whether it is a package's face."""
    found = {}
    for room in ("smartshoe", "simulators"):
        for path in (ROOT / room).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            face = parts[-1] == "__init__"
            found[".".join(parts[:-1] if face else parts)] = (ast.parse(path.read_text(encoding="utf-8")), face)
    return found


def _statements(node: ast.AST, *, types: bool = False) -> Iterator[ast.stmt]:
    """All statements below ``node``, those of functions too; ``types``: those that only a type checker reads too."""
    for child in ast.iter_child_nodes(node):
        if not types and isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        if isinstance(child, ast.stmt):
            yield child
        if isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield from _statements(child, types=types)


def _imported(name: str, *, types: bool = False) -> set[str]:
    """The modules of the two packages that ``name`` imports, by the time its functions have run."""
    modules = _modules()
    tree, _ = modules[name]
    found = set()
    for statement in _statements(tree, types=types):
        if isinstance(statement, ast.Import):
            found |= {alias.name for alias in statement.names}
        elif isinstance(statement, ast.ImportFrom):
            assert statement.level == 0, f"{name} imports by a relative name"
            for alias in statement.names:
                below = f"{statement.module}.{alias.name}"
                found.add(below if below in modules else str(statement.module))
    return {module for module in found if module in modules and module != name}


def test_no_class_name_stands_in_two_places() -> None:
    homes = defaultdict(list)
    for module, (tree, _) in _modules().items():
        for statement in _statements(tree):
            if isinstance(statement, ast.ClassDef):
                homes[statement.name].append(module)
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_imports_never_come_back_not_even_inside_functions() -> None:
    try:
        TopologicalSorter({name: _imported(name) for name in _modules()}).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(reversed(error.args[1])))


def test_a_private_module_is_imported_by_its_room_alone() -> None:
    """A module ``_x`` is its folder's own: what others use stands at the face, or in a module without ``_``."""
    strangers = []
    for name in _modules():
        for module in _imported(name, types=True):
            room, _, last = module.rpartition(".")
            if last.startswith("_") and not f"{name}.".startswith(f"{room}."):
                strangers.append(f"{name} -> {module}")
    assert strangers == []


@pytest.mark.parametrize("room", ["diagnosis", "integrity"])
def test_each_file_of_a_large_room_has_its_place_in_the_architecture(room: str) -> None:
    """And no file that is gone has one."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = text.split(f"| step of `{room}/` | files |", 1)[1].split("\n\n", 1)[0]
    files = {path.stem.lstrip("_") for path in (ROOT / "smartshoe" / room).glob("*.py")} - {"init__"}
    assert set(re.findall(r"`(\w+)`", table)) == files
