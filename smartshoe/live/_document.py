"""Builds the page as one self-contained document from its markup, style and scripts."""

from __future__ import annotations

import base64
import hashlib
import json
from importlib.resources import files

from smartshoe.gait.insole import OUTLINE, PLACES


def document() -> tuple[str, str]:
    """The page's HTML, and a content security policy that allows only the page's own script and style."""
    folder = files("smartshoe.live") / "page"
    style = (folder / "live.css").read_text(encoding="utf-8")
    facts = f"const INSOLE = {json.dumps({'outline': OUTLINE, 'places': dict(PLACES)})};\n"
    script = facts + "".join((folder / name).read_text(encoding="utf-8") for name in SCRIPTS)
    page = (folder / "live.html").read_text(encoding="utf-8")
    page = page.replace("/*STYLE*/", style).replace("/*SCRIPT*/", script)
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; connect-src 'self';"
        " img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return page, policy


SCRIPTS = ("frames.js", "insole.js", "traces.js", "live.js")


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
