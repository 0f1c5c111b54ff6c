"""The detector on measured plates: two walks over seven plates, whose vertical axis is FY (BMClab)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.gait import ContactDetector

Array = NDArray[np.float64]

PLATE_N = 20.0  # at which a plate is usually read


def _plates(path: Path) -> tuple[float, Array]:
    """Sample rate, and the vertical forces (n, 7) in N."""
    lines = path.read_text(encoding="latin-1").splitlines()
    rate_hz = float(next(line for line in lines if line.startswith("SampleRate")).split("=")[1])
    head = next(index for index, line in enumerate(lines) if line.startswith("#Sample"))
    names = lines[head].split("\t")
    cells = [line.split("\t")[: len(names)] for line in lines[head + 1 :] if line.strip()]
    vertical = [index for index, name in enumerate(names) if name.startswith("FY")]
    return rate_hz, np.array([[float(row[index]) for index in vertical] for row in cells])


@pytest.mark.real_data
@pytest.mark.parametrize("walk", ["walk1", "walk2"])
def test_contacts_of_measured_plates(measured: Path, walk: str) -> None:
    rate_hz, force_n = _plates(measured / "grf_walking_running" / f"{walk}.forces")
    seen = 0
    for plate_n in force_n.T:
        found = ContactDetector(rate_hz, ("heel",)).apply(plate_n[:, None])
        on = np.flatnonzero(plate_n > PLATE_N)
        if on.size == 0:
            assert len(found) == 0
            continue
        assert len(found) == 1
        if on[0] > 0.1 * rate_hz:
            assert found.strike_s[0] == pytest.approx(on[0] / rate_hz, abs=0.005)
            seen += 1
        if on[-1] < plate_n.size - 0.1 * rate_hz:
            assert found.toe_off_s[0] == pytest.approx(on[-1] / rate_hz, abs=0.005)
            seen += 1
    assert seen >= 5


@pytest.mark.real_data
def test_steps_over_plates_make_a_walk(measured: Path) -> None:
    rate_hz, force_n = _plates(measured / "grf_walking_running" / "walk1.forces")
    # In order of time the steps fall on plates 6, 5, 3 and 4.
    feet = (force_n[:, 5] + force_n[:, 2], force_n[:, 4] + force_n[:, 3])
    contacts = [ContactDetector(rate_hz, ("heel",)).apply(foot[:, None]) for foot in feet]
    strikes_s = np.sort(np.concatenate([own.strike_s for own in contacts]))
    assert strikes_s.size == 4
    # 0.55 s a step, as at 1.3 m/s.
    assert np.diff(strikes_s) == pytest.approx(0.55, abs=0.02)
