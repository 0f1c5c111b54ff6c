"""What several files of these tests share."""

from __future__ import annotations

from typing import Any

import pytest
from told_diagnosis import told_parts


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Every step of a diagnosis by what it is told to answer."""
    return told_parts(monkeypatch)
