"""The table of thresholds in the guide is the record that decides."""

from __future__ import annotations

import re
from pathlib import Path

from smartshoe.diagnosis import Thresholds, described


def test_the_guide_lists_every_threshold_with_its_value_unit_meaning_and_origin(root: Path) -> None:
    text = (root / "docs" / "diagnosis_rules.md").read_text(encoding="utf-8")
    section = text.split("## Every number that decides\n")[1].split("\n## ")[0]
    listed = re.findall(r"^\| `(.+?)` \| (.+?) \| (.+?) \| (.+?) \| (.+?) \|$", section, re.MULTILINE)
    wanted = [
        (one["name"], str(one["value"]), one["unit"], one["meaning"], one["origin"]) for one in described(Thresholds())
    ]
    assert listed == wanted, "\n".join("| `{}` | {} | {} | {} | {} |".format(*row) for row in wanted)
