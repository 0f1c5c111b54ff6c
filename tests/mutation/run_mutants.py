"""Puts small bugs into a room, one at a time, and tells which of them the room's tests do not notice.

``python tests/mutation/run_mutants.py units journal --count 30 --seed 1 --keep out/mutants.jsonl`` draws thirty mutants
a room; without a room's name it takes all of ``rooms.toml``. The same seed on the same source draws the same ones. What
the kept file holds is not run again; with ``--survivors`` those that survived are. ``--listed`` runs the bugs of
``listed.toml`` instead. A mutant whose name stands in docs/reliability.md is argued for there and counts as neither.

Each is put into a copy of the checkout, so that programs that tests start meet it too. Of the room's tests those files
are run that call its function. Tests that take more than three times the processor time that they take without it count
as having noticed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from forked_tests import import_libraries, run_tests
from mutants import changed, changes

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COPIED = ("smartshoe", "simulators", "tests", "scenarios", "docs", "pyproject.toml", "README.md", "CHANGELOG.md")
ARGUED = ROOT / "docs" / "reliability.md"
SLOWER, LEAST_S = 3.0, 20.0  # times the usual processor time, and never less, before tests count as hanging
Result = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Mutant:
    """One small bug: its room, the file and its text with the bug, the tests that are to notice."""

    room: str
    file: str
    line: int
    function: int
    shown: str
    text: str = field(repr=False)
    tests: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What it is called in the kept file and in docs/reliability.md."""
        return f"{self.file.removeprefix('smartshoe/')}: {self.shown}"


class Kept:
    """What is known from earlier runs: results by mutant, costs and calls by file of tests."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.results: dict[str, Result] = {}
        self.tests: dict[str, Result] = {}
        for line in path.read_text(encoding="utf-8").splitlines() if path and path.exists() else ():
            self._take(json.loads(line))

    def _take(self, item: Result) -> None:
        if "calls" in item:
            self.tests[item["name"]] = item
        else:
            self.results[item["name"]] = item

    def add(self, item: Result) -> Result:
        """Remember ``item``, on disk where a file was given."""
        self._take(item)
        if self._path:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(item, ensure_ascii=False) + "\n")
        return item


class Checkout:
    """A copy of the checkout, in which one file at a time is another."""

    def __init__(self, path: Path, kept: Kept) -> None:
        self.path, self._kept = path, kept

    def matching(self, globs: list[str]) -> list[str]:
        """The files that ``globs`` name, as texts from the checkout's root; `SystemExit` where one names none."""
        for glob in globs:
            if not any(self.path.glob(glob)):
                raise SystemExit(f"rooms.toml: {glob} names no file: it has moved")
        return sorted({str(path.relative_to(self.path)) for glob in globs for path in self.path.glob(glob)})

    def measured(self, test: str) -> Result:
        """Cost in s and calls of a file of tests, as the source is; raises `SystemExit` where one fails."""
        digest = hashlib.sha256((self.path / test).read_bytes()).hexdigest()[:16]
        known = self._kept.tests.get(test, {})
        if known.get("digest") != digest:
            ended = run_tests(self.path, [test], 3600.0, calls=True)
            if ended.status != 0:
                raise SystemExit(f"{test} fails as the source is:\n{(self.path / 'said.txt').read_text()[-3000:]}")
            about = {"name": test, "digest": digest, "cost_s": round(ended.cpu_s, 2)}
            self._kept.add({**about, "calls": [list(call) for call in sorted(ended.calls)]})
        return self._kept.tests[test]

    def tried(self, mutant: Mutant) -> Result:
        """Put ``mutant`` in, run its tests, cheapest first, and take it out.

        Of a function that files of tests call, only those are run; of one that only compiled code or other programs
        call, all.
        """
        about = {test: self.measured(test) for test in mutant.tests}
        calling = {test: item for test, item in about.items() if [mutant.file, mutant.function] in item["calls"]}
        about = calling or about
        order = sorted(about, key=lambda test: about[test]["cost_s"])
        usual_s = sum(item["cost_s"] for item in about.values())
        with self._with(mutant):
            ended = run_tests(self.path, order, max(LEAST_S, SLOWER * usual_s))
        outcome = "survived" if ended.status == 0 else "hung" if ended.status is None else "killed"
        by = ended.failed.removeprefix("tests/")
        found = {"room": mutant.room, "name": mutant.name, "line": mutant.line, "outcome": outcome, "by": by}
        return self._kept.add({**found, "cpu_s": round(ended.cpu_s, 1)})

    @contextmanager
    def _with(self, mutant: Mutant) -> Iterator[None]:
        path, kernels, aside = self.path / mutant.file, self.path / "smartshoe" / "kernels", self.path / "compiled"
        text, state = path.read_text(encoding="utf-8"), path.stat()
        if path.parent == kernels:
            # numba compiles what has changed and not what calls it: all is compiled anew.
            shutil.move(kernels / "__pycache__", aside)
        path.write_text(mutant.text, encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(text, encoding="utf-8")
            os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
            if aside.exists():
                shutil.rmtree(kernels / "__pycache__", ignore_errors=True)
                shutil.move(aside, kernels / "__pycache__")


def drawn(checkout: Checkout, room: str, about: dict[str, list[str]], count: int, seed: int) -> list[Mutant]:
    """``count`` of a room's mutants, the same for a seed and a source."""
    texts = {name: (checkout.path / name).read_text(encoding="utf-8") for name in checkout.matching(about["files"])}
    every = [(name, change) for name, text in texts.items() for change in changes(text)]
    chosen = random.Random(f"{seed} {room}").sample(every, min(count, len(every)))
    tests = tuple(checkout.matching(about["tests"]))
    return [
        Mutant(room, name, change.line, change.function, str(change), changed(texts[name], change.number), tests)
        for name, change in chosen
    ]


def listed(checkout: Checkout) -> list[Mutant]:
    """The bugs of ``listed.toml``; one whose place is no longer in the source is told and left out."""
    found = []
    for item in tomllib.loads((HERE / "listed.toml").read_text(encoding="utf-8"))["mutant"]:
        text = (checkout.path / item["file"]).read_text(encoding="utf-8")
        if text.count(item["before"]) != 1:
            print(f"{item['says']}: {item['file']} has changed, look it up anew", file=sys.stderr)
            continue
        bug = text.replace(item["before"], item["after"])
        found.append(Mutant("listed", item["file"], 0, 0, item["says"], bug, tuple(item["tests"])))
    return found


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


def told(results: list[Result], argued: str) -> str:
    """A line a room, and the survivors."""
    lines = []
    for room in dict.fromkeys(result["room"] for result in results):
        own = [result for result in results if result["room"] == room]
        alive = [result for result in own if result["outcome"] == "survived"]
        open_ = [result for result in alive if result["name"] not in argued]
        counted, killed = len(own) - len(alive) + len(open_), len(own) - len(alive)
        share = 100.0 * killed / max(counted, 1)
        lines.append(f"{room}: {killed} of {counted} killed ({share:.0f} %), {len(alive) - len(open_)} argued for")
        lines += [f"    line {result['line']}: {result['name']}" for result in open_]
    return "\n".join(lines)


def main() -> None:
    """The command."""
    table = tomllib.loads((HERE / "rooms.toml").read_text(encoding="utf-8"))
    parser = argparse.ArgumentParser(description="small bugs that a room's tests do not notice")
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(table)} (default: all)")
    parser.add_argument("--count", type=int, default=30, help="mutants a room (default: 30)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file of results, a JSON line each: what it holds is not run again")
    parser.add_argument("--listed", action="store_true", help="the bugs of listed.toml in place of drawn ones")
    parser.add_argument("--survivors", action="store_true", help="run those again that the kept file calls survivors")
    options = parser.parse_args()
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1")
    os.environ.setdefault("SMARTSHOE_MEASURED", str(ROOT.parent / "shared" / "data"))
    import_libraries()
    kept = Kept(options.keep)
    again = {name for name, item in kept.results.items() if options.survivors and item["outcome"] == "survived"}
    results = []
    with copied() as copy:
        checkout = Checkout(copy, kept)
        rooms = options.rooms or list(table)
        chosen = [m for room in rooms for m in drawn(checkout, room, table[room], options.count, options.seed)]
        for mutant in listed(checkout) if options.listed else chosen:
            is_known = mutant.name in kept.results and mutant.name not in again
            results.append(kept.results[mutant.name] if is_known else checkout.tried(mutant))
    print(told(results, ARGUED.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
