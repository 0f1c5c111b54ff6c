"""Puts small bugs into a room, one at a time, and tells which of them the room's tests do not notice.

``python tests/mutation/run_mutants.py units journal --count 30 --seed 1 --keep out/mutants.jsonl`` draws thirty mutants
a room; without a room's name it takes all of ``rooms.toml``. The same seed on the same source draws the same ones. What
the kept file holds is not run again; with ``--survivors`` those that survived are. ``--listed`` runs the bugs of
``listed.toml`` instead. A mutant whose name stands in ``equivalent.md`` cannot matter, and counts as neither.

Each is put into a copy of the checkout, so that programs that tests start meet it too. Which lines each test runs is
found once (the kept file holds that as well); of the room's tests those are run that run the mutant's lines, cheapest
first, until one fails or takes four times its usual processor time, and ``--most`` s at most: what only a longer one
would notice counts as unnoticed. Compiled kernels are tried in plain Python.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import accumulate
from pathlib import Path
from typing import Any

from forked_tests import NOT_SWAPPED, UNDECIDED, Costs, Ended, import_libraries, record, run_fresh, serve
from mutants import changed, changes

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COPIED = ("smartshoe", "simulators", "tests", "scenarios", "docs", "pyproject.toml", "README.md", "CHANGELOG.md")
EQUIVALENT = HERE / "equivalent.md"
KERNELS = "smartshoe/kernels/"
Result = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Mutant:
    """One small bug: its room, its file as it was, the lines of its statement, and the bug's number or its text."""

    room: str
    file: str
    line: int
    last: int
    shown: str
    text: str = field(repr=False)
    number: int = 0
    bug: str = field(default="", repr=False)
    costs: Costs = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """What it is called in the kept file and in ``equivalent.md``."""
        return f"{self.file.removeprefix('smartshoe/')}: {self.shown}"

    @property
    def is_compiled(self) -> bool:
        """Whether numba compiles its file."""
        return self.file.startswith(KERNELS)

    def tree(self) -> ast.Module:
        """The file with the bug in it."""
        return ast.parse(self.bug) if self.bug else changed(self.text, self.number)


class Kept:
    """What is known from earlier runs: results by mutant, and by file of tests what each of its tests runs."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.results: dict[str, Result] = {}
        self.recorded: dict[str, Result] = {}
        self.read()

    def read(self) -> None:
        """Take what the file holds, which another process may have written."""
        for line in self._path.read_text(encoding="utf-8").splitlines() if self._path.exists() else ():
            item = json.loads(line)
            (self.recorded if "recorded" in item else self.results)[item["name"]] = item

    def add(self, item: Result) -> None:
        """Remember ``item``, on disk."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(item, ensure_ascii=False) + "\n")
        self.read()


class Room:
    """Files of a copied checkout and the tests that hold them, in compiled or in plain Python."""

    def __init__(self, path: Path, kept: Kept, about: dict[str, list[str]], plain_python: bool, most_s: float) -> None:
        files, tests = about["files"], about["tests"]
        self._path, self._kept, self._plain_python, self._most_s = path, kept, plain_python, most_s
        self._texts = {name: (path / name).read_text(encoding="utf-8") for name in files}
        self._tests: dict[str, Result] = {}
        self._imported: set[tuple[str, int]] = set()
        self._files = tests
        self._know(files, tests)

    def _know(self, files: list[str], tests: list[str]) -> None:
        """Find what the tests run, but for what is known already of these very files."""
        source = f"{self._texts} {self._plain_python}"
        named = {}
        for test in tests:
            text = (self._path / test).read_text(encoding="utf-8")
            named[f"{test} {hashlib.sha256((source + text).encode()).hexdigest()[:16]}"] = test
        new = [test for name, test in named.items() if name not in self._kept.recorded]
        found = record(self._path, new, files, self._plain_python) if new else {}
        for name, test in named.items():
            if test in new:
                own = {key: about for key, about in found["tests"].items() if key.startswith(f"{test}::")}
                self._kept.add({"name": name, "recorded": own, "imported": found["imported"]})
            item = self._kept.recorded[name]
            self._tests |= item["recorded"]
            self._imported |= {(file, line) for file, line in item["imported"]}
        failed = [name for name, about in self._tests.items() if about["outcome"] == "failed"]
        if failed and not self._plain_python:
            raise SystemExit("\n".join(["these tests fail as the source is:", *failed]))

    def _costs(self, lines: Iterable[tuple[str, int]]) -> Costs:
        """The tests that run one of ``lines``, cheapest first, then those that start programs, which are not seen."""
        wanted: dict[str, set[int]] = {}
        for file, line in lines:
            wanted.setdefault(file, set()).add(line)
        passed = [(about["cost_s"], name) for name, about in self._tests.items() if about["outcome"] == "passed"]

        def runs(name: str) -> bool:
            return any(not own.isdisjoint(self._tests[name]["lines"].get(file, ())) for file, own in wanted.items())

        seen = {name: cost_s for cost_s, name in sorted(passed) if runs(name)}
        return seen | {name: cost_s for cost_s, name in sorted(passed) if self._tests[name]["started"]}

    def _affordable(self, costs: Costs) -> Costs:
        """The first of ``costs`` that together take no longer than asked, and one at least."""
        sums = accumulate(costs.values())
        few = sum(sum_s <= self._most_s for sum_s in sums)
        return dict(list(costs.items())[: max(few, 1)])

    def _concerning(self, mutant: Mutant) -> Costs:
        """The tests of a bug in what an import runs: first those that run a line which names what it gives."""
        lines = range(mutant.line, mutant.last + 1)
        named = [node for node in ast.walk(ast.parse(mutant.text)) if getattr(node, "lineno", 0) in lines]
        names = {node.id for node in named if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        functions = [node for node in named if isinstance(node, ast.FunctionDef | ast.ClassDef)]
        words = "|".join(re.escape(name) for name in {*names, *(node.name for node in functions)}) or r"(?!)"
        told = [
            (file, number)
            for file, text in self._texts.items()
            for number, line in enumerate(text.split("\n"), 1)
            if re.search(rf"\b({words})\b", line)
        ]
        told += [(mutant.file, line) for node in functions for line in range(node.lineno, (node.end_lineno or 0) + 1)]
        anywhere = ((mutant.file, line) for line in range(1, mutant.text.count("\n") + 2))
        return self._costs(told) | self._costs(anywhere)

    def try_each(self, mutants: list[Mutant]) -> None:
        """Put each in, run its tests, take it out, and remember how it ended."""
        quick, slow = [], []
        for mutant in mutants:
            lines = {(mutant.file, line) for line in range(mutant.line, mutant.last + 1)}
            if lines & self._imported:
                slow.append(replace(mutant, costs=self._affordable(self._concerning(mutant))))
            else:
                quick.append(replace(mutant, costs=self._affordable(self._costs(lines))))
        if quick:
            serve(self._path, self._files, quick, self._plain_python, self._remember)
            self._kept.read()
        left = [mutant for mutant in quick if self._kept.results[mutant.name]["outcome"] == NOT_SWAPPED]
        for mutant in [*left, *slow]:
            self._remember(mutant, run_fresh(self._path, mutant, self._plain_python))

    def _remember(self, mutant: Mutant, ended: Ended) -> None:
        about = {"room": mutant.room, "name": mutant.name, "line": mutant.line, "outcome": ended.outcome}
        by = ended.failed.removeprefix("tests/")
        self._kept.add({**about, "by": by, "tests": len(mutant.costs), "cpu_s": round(ended.cpu_s, 1)})


def matching(path: Path, globs: list[str]) -> list[str]:
    """The files that ``globs`` name, as texts from the checkout's root; `SystemExit` where one names none."""
    for glob in globs:
        if not any(path.glob(glob)):
            raise SystemExit(f"rooms.toml: {glob} names no file: it has moved")
    return sorted({str(found.relative_to(path)) for glob in globs for found in path.glob(glob)})


def drawn(path: Path, room: str, files: list[str], count: int, seed: int) -> list[Mutant]:
    """``count`` of a room's mutants, the same for a seed; where some lines are edited, the same of all others."""
    every = []
    for name in files:
        text = (path / name).read_text(encoding="utf-8")
        twins: Counter[str] = Counter()
        for change in changes(text):
            key = f"{seed} {Path(name).stem.lstrip('_')} {change} {twins[str(change)]}"
            twins[str(change)] += 1
            mutant = Mutant(room, name, change.line, change.last, str(change), text, change.number)
            every.append((hashlib.sha256(key.encode()).hexdigest(), mutant))
    return [mutant for _, mutant in sorted(every, key=lambda item: item[0])[:count]]


def listed(path: Path, items: list[dict[str, Any]]) -> Iterator[Mutant]:
    """The bugs of ``listed.toml``; one whose place is no longer in the source is told and left out."""
    for item in items:
        text = (path / item["file"]).read_text(encoding="utf-8")
        if text.count(item["before"]) != 1:
            print(f"{item['says']}: {item['file']} has changed, look it up anew", file=sys.stderr)
            continue
        line = text[: text.index(item["before"])].count("\n") + 1
        last, bug = line + item["before"].count("\n"), text.replace(item["before"], item["after"])
        yield Mutant("listed", item["file"], line, last, item["says"], text, bug=bug)


@contextmanager
def copied() -> Iterator[Path]:
    """A copy of the checkout, with what numba has compiled."""
    with tempfile.TemporaryDirectory(prefix="mutants-") as made:
        copy = Path(made).resolve() / "checkout"
        copy.mkdir()
        for name in COPIED:
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, copy / name)
            else:
                shutil.copy2(ROOT / name, copy / name)
        yield copy


def told(results: list[Result], equivalent: str) -> str:
    """A line a room, and the survivors."""
    lines = []
    for room in dict.fromkeys(result["room"] for result in results):
        own = [result for result in results if result["room"] == room]
        alive = [result for result in own if result["outcome"] not in ("killed", "hung")]
        open_ = [result for result in alive if result["name"] not in equivalent]
        counted, killed = len(own) - len(alive) + len(open_), len(own) - len(alive)
        share = 100.0 * killed / max(counted, 1)
        lines.append(f"{room}: {killed} of {counted} killed ({share:.0f} %), {len(alive) - len(open_)} equivalent")
        lines += [f"    line {result['line']}: {result['name']}" for result in open_]
    return "\n".join(lines)


def main() -> None:
    """The command."""
    table = tomllib.loads((HERE / "rooms.toml").read_text(encoding="utf-8"))
    parser = argparse.ArgumentParser(description="small bugs that a room's tests do not notice")
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(table)} (default: all)")
    parser.add_argument("--count", type=int, default=30, help="mutants a room (default: 30)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=float, default=20.0, metavar="S", help="processor time of a mutant's tests (20)")
    parser.add_argument("--keep", type=Path, help="file of results, a JSON line each: what it holds is not run again")
    parser.add_argument("--listed", action="store_true", help="the bugs of listed.toml in place of drawn ones")
    parser.add_argument("--survivors", action="store_true", help="run those again that the kept file calls survivors")
    options = parser.parse_args()
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1")
    os.environ.setdefault("SMARTSHOE_MEASURED", str(ROOT.parent / "shared" / "data"))
    import_libraries()
    results = []
    with copied() as copy:
        kept = Kept(options.keep or copy.parent / "kept.jsonl")
        wanted = {UNDECIDED, NOT_SWAPPED, *(["survived"] if options.survivors else [])}
        again = {name for name, item in kept.results.items() if item["outcome"] in wanted}
        if options.listed:
            items = tomllib.loads((HERE / "listed.toml").read_text(encoding="utf-8"))["mutant"]
            files, tests = {item["file"] for item in items}, {test for item in items for test in item["tests"]}
            table = {"listed": {"files": sorted(files), "tests": sorted(tests)}}
            bugs = {"listed": list(listed(copy, items))}
        else:
            table = {
                room: {key: matching(copy, table[room][key]) for key in ("files", "tests")}
                for room in options.rooms or table
            }
            bugs = {room: drawn(copy, room, table[room]["files"], options.count, options.seed) for room in table}
        for room, mutants in bugs.items():
            new = [mutant for mutant in mutants if mutant.name not in kept.results or mutant.name in again]
            for plain_python in (False, True):
                own = [mutant for mutant in new if mutant.is_compiled == plain_python]
                if own:
                    Room(copy, kept, table[room], plain_python, options.most).try_each(own)
            results += [kept.results[mutant.name] for mutant in mutants]
    print(told(results, EQUIVALENT.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
