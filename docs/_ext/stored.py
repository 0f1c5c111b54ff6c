"""Figures that take too long for a build: stored in the pages, each with the command and the commit that made them.

``docs/stored_results.toml`` has an entry a page, with a digest of the page's tables. The directive ``stored-results``
lists them, with the commits since that touched what they are about, and warns (which fails a build with ``-W``) where a
table is another than the one that was stored. After the command of a page ran and its tables were put in:

    python docs/_ext/stored.py PAGE
"""

from __future__ import annotations

import datetime
import hashlib
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, ClassVar

DOCS = Path(__file__).resolve().parents[1]
LEDGER = DOCS / "stored_results.toml"


def entries() -> list[dict[str, Any]]:
    """The stored results in the ledger's order."""
    found: list[dict[str, Any]] = tomllib.loads(LEDGER.read_text(encoding="utf-8"))["result"]
    return found


def digest(entry: dict[str, Any]) -> str:
    """The first 16 digits of the SHA-256 of the rows of every table in the entry's page, or its section of it."""
    text = (DOCS / f"{entry['page']}.md").read_text(encoding="utf-8")
    if "section" in entry:
        start = text.index(f"\n## {entry['section']}\n") + 1
        end = text.find("\n## ", start)
        text = text[start : end if end > 0 else None]
    rows = [line.strip() for line in text.splitlines() if line.startswith("|")]
    return hashlib.sha256("\n".join(rows).encode()).hexdigest()[:16]


def git(*words: str) -> str | None:
    """What git says, None where there is no git or no such history."""
    try:
        done = subprocess.run(["git", "-C", str(DOCS), *words], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def since(entry: dict[str, Any]) -> str:
    """How much has happened to the entry's rooms since its figures were made."""
    count = git("rev-list", "--count", f"{entry['commit']}..HEAD", "--", *(f":/{room}" for room in entry["rooms"]))
    if count is None:
        return "not known: this copy has no history"
    return "none" if count == "0" else f"{count} {'commit' if count == '1' else 'commits'}"


def stamp(page: str) -> None:
    """Write that the tables of ``page`` were made at the commit that is checked out."""
    commit = git("rev-parse", "--short", "HEAD")
    chosen = [entry for entry in entries() if entry["page"] == page]
    if commit is None or not chosen:
        raise SystemExit(f"{page} has no entry in {LEDGER.name}" if commit else "no git history: nothing to stamp with")
    text = LEDGER.read_text(encoding="utf-8")
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    for entry in chosen:
        old = f'commit = "{entry["commit"]}"\ndate = "{entry["date"]}"\ndigest = "{entry["digest"]}"'
        if old not in text:
            raise SystemExit(f"{LEDGER.name}: {page} needs commit, date and digest in this order, a line each")
        text = text.replace(old, f'commit = "{commit}"\ndate = "{today}"\ndigest = "{digest(entry)}"')
    LEDGER.write_text(text, encoding="utf-8")


def setup(app: Any) -> dict[str, Any]:
    from docutils import nodes
    from docutils.parsers.rst import Directive
    from docutils.statemachine import StringList
    from sphinx.util import logging

    class StoredResults(Directive):
        """The ledger as a table."""

        has_content: ClassVar[bool] = False

        def run(self) -> list[Any]:
            lines = ["| page | what | made by | at | since then |", "| --- | --- | --- | --- | --- |"]
            for entry in entries():
                if digest(entry) != entry["digest"]:
                    logging.getLogger(__name__).warning(
                        "the tables of %s.md are not those stored at %s: run %s, then python docs/_ext/stored.py %s",
                        entry["page"], entry["commit"], entry["command"], entry["page"],
                    )  # fmt: skip
                lines.append(f"| [{entry['page']}]({entry['page']}.md) | {entry['what']} | `{entry['command']}` |"
                             f" {entry['commit']}, {entry['date']} | {since(entry)} |")  # fmt: skip
            holder = nodes.container()
            self.state.nested_parse(StringList(lines, source=LEDGER.name), self.content_offset, holder)
            return list(holder.children)

    app.add_directive("stored-results", StoredResults)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    stamp(sys.argv[1])
