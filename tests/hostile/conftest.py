"""What the tests of disks share: the process that forks the commands, and what the commands read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from hosted_commands import Host


@pytest.fixture(scope="session")
def host() -> Iterator[Host]:
    from hosted_commands import Host

    found = Host()
    yield found
    found.close()


@pytest.fixture(scope="session")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What every command reads."""
    from writing_commands import write_inputs

    folder = tmp_path_factory.mktemp("inputs")
    write_inputs(folder)
    return folder
