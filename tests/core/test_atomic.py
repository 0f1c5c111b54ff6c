"""Files are written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from smartshoe.atomic import make_folder, replacing, write_text
from smartshoe.errors import UsageError


def test_a_failure_leaves_the_old_file_and_no_litter(tmp_path: Path) -> None:
    target = tmp_path / "result.json"
    write_text(target, "old")

    def fail_half_way() -> None:
        with replacing(target) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_places_that_cannot_be_written_are_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is a directory"):
        write_text(tmp_path, "x")
    with pytest.raises(UsageError, match="cannot be written"):
        write_text(tmp_path / "missing" / "x.json", "x")
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="--out"):
        make_folder(tmp_path / "file" / "below")
