"""Our events beside seven published in-shoe algorithms, on simulated trials and measured plates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from in_shoe_events import OURS, cases, load_peers, page, scores_of
from table import FigureTable

from smartshoe.files.atomic import write_text

pytestmark = [pytest.mark.benchmark, pytest.mark.real_data]
CONTACT_MS, OFF_MS = 2.0, 4.0


def test_events_beside_the_seven(table: FigureTable, measured: Path, request: pytest.FixtureRequest) -> None:
    code = measured.parent / "peers" / "in_shoe_events" / "Algorithms.py"
    if not code.is_file():
        pytest.skip(f"no peers at {code}")
    for package in ("matplotlib", "ezc3d"):
        pytest.importorskip(package)
    peers = load_peers(code)
    results = {case.name: scores_of(case, peers) for case in cases(measured / "grf_walking_running")}
    for case, scores in results.items():
        ours = scores[OURS]
        for what, asked in (("contact_ms", CONTACT_MS), ("off_ms", OFF_MS)):
            value = getattr(ours, what)
            others = {name: getattr(score, what) for name, score in scores.items() if name != OURS}
            name = min(others, key=lambda each: np.nan_to_num(others[each], nan=np.inf))
            peer = f"{others[name]:.1f} ms ({name})"
            table.add(case, what, f"{value:.1f} ms", asked=f"{asked:g} ms", peer=peer, met=bool(value <= asked))
            # A peer that misses all is not ahead of anyone.
            assert value <= np.median(np.nan_to_num(list(others.values()), nan=np.inf)), (case, what)
    target = request.config.getoption("--events-page")
    if target is not None:
        write_text(target, page(results))
