"""The kinds of noise that a diagnosis tells, without a memory and with one, in the order in which it asks for them."""

from __future__ import annotations

from typing import Any

from smartshoe.diagnosis._noise_kinds import noise_with_memory, noise_without_memory
from smartshoe.integrity import DataFault


def kinds_of_noise(
    fine: Any, model: Any, known: list[DataFault], explained: bool, material: float, memory: Any
) -> list[DataFault]:
    first = noise_without_memory(fine, model, known, material)
    return [*first, *noise_with_memory(fine, model, [*known, *first], explained, material, memory)]
