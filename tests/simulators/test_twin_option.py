"""A scenario's bladder may be a calibration: ``bladder = {twin = "unit.json"}``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pydantic
import pytest

from simulators.provider import provider
from smartshoe.calibration import extended_calibration
from smartshoe.errors import InputError
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import dynamic_protocol


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "unit.json"
    extended_calibration(ExtendedModel(1.0, 0.15, 0.3, 800.0, 70.0, "mbar"), unit="left_toe").save(path)
    return str(path)


def test_the_machine_presses_the_calibration_and_the_recording_says_so(file):
    options = {"unit": "left_toe", "bladder": {"twin": file}, "sensor": {"noise_percent": 0.0}}
    with provider.open_machine("instron", options, np.random.default_rng(1)) as machine:
        recording = machine.run(dynamic_protocol([100.0], rest_s=2.0))
    assert "unit.json" in recording.metadata["is_twin"]
    # 800 N read 70 mbar once the arm has relaxed; a share of 0.15 does so with 0.3/s.
    assert 60.0 < recording["pressure"].values.max() < 70.0


def test_wrong_twins_are_refused_by_key_and_by_file(file, tmp_path):
    with pytest.raises(pydantic.ValidationError) as caught:
        provider.open_machine("instron", {"bladder": {"twin": file, "k1": 1.0}})
    assert caught.value.errors()[0]["loc"] == ("bladder", "k1")
    with pytest.raises(InputError, match=r"none\.json"):
        provider.open_machine("instron", {"bladder": {"twin": str(tmp_path / "none.json")}})
