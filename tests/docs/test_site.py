"""The site holds together: every page has a place in it, every link between files an end; ``-m site`` builds it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from smartshoe import __all__ as public

DOCS = Path(__file__).resolve().parents[2] / "docs"
FENCED = re.compile(r"^(`{3,}).*?^\1", re.DOTALL | re.MULTILINE)
PAGES = sorted(path for path in DOCS.rglob("*.md") if not {"api", "tutorial"} & set(path.parts[len(DOCS.parts) : -1]))
FRONT = [DOCS.parent / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]


def listed() -> list[str]:
    """The pages that the toctrees of the index name, without suffix."""
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    trees = re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL)
    return [line for tree in trees for line in tree.splitlines() if line and not line.startswith(":")]


def slugs(path: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and MyST make them."""
    headings = re.findall(r"^#+ (.+)$", FENCED.sub("", path.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def made_by_the_build(target: str) -> bool:
    """Whether ``target`` (relative to docs/) is a tutorial page whose script is there."""
    folder, _, page = target.partition("/")
    return folder == "tutorial" and (page == "index" or (DOCS / "examples" / f"{page}.py").is_file())


def test_every_page_is_in_one_toctree_and_every_entry_is_a_page() -> None:
    entries = listed()
    assert len(entries) == len(set(entries))
    pages = {path.relative_to(DOCS).with_suffix("").as_posix() for path in PAGES} - {"index"}
    assert {entry for entry in entries if not made_by_the_build(entry)} == pages


@pytest.mark.parametrize("page", [*PAGES, *FRONT], ids=lambda path: path.stem)
def test_no_link_between_files_is_dead(page: Path) -> None:
    text = re.sub(r"`[^`\n]*`", "", FENCED.sub("", page.read_text(encoding="utf-8")))
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link) or (page.parent == DOCS and made_by_the_build(link)):
            continue
        name, _, anchor = link.partition("#")
        end = page.parent / name if name else page
        assert end.exists(), f"{page.name} links to {link}"
        assert not anchor or anchor in slugs(end), f"{page.name} links to {link}: no such heading"


def test_the_reference_holds_every_public_name() -> None:
    text = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^   ([A-Za-z_]\w*)$", text, re.MULTILINE))
    assert named == set(public)


@pytest.mark.site
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", str(DOCS), str(tmp_path / "site")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site" / "tutorial" / "calibrate_a_unit.html").is_file()
