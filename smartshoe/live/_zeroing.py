"""The zero button: what each unloaded unit shows becomes its zero; a loaded foot is refused."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait.field import check_zero
from smartshoe.live._shoe import LiveShoe

LOOKED_AT_S = 2.0


def zeros_of(live: LiveShoe) -> Iterator[tuple[str, tuple[int, ...], Array | None]]:
    """Yield for each foot a sentence, its columns, and their values at rest (c,), or None if it is not at rest."""
    time_s, readings = live.readings_of_last(LOOKED_AT_S)
    shown = live.shown_of_last(LOOKED_AT_S)
    for foot in live.feet:
        columns = foot.columns
        who = f"the {foot.side} foot" if foot.side else "the foot"
        names = [live.names[c] for c in columns]
        scale = np.array([live.full_scale(c) for c in columns])
        found = check_zero(time_s, readings[:, columns], names, full_scale=scale, symbol=live.unit.symbol)
        refused = [each for each in found if not each.is_usable]
        if refused:
            yield f"{who} is not zeroed: {refused[0].says}", columns, None
            continue
        yield f"{who} is zeroed", columns, np.nanmean(shown[:, columns], axis=0)
