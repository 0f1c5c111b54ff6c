"""`Operator`: whoever stands at the machine; instructions go to it, confirmations and decisions come from it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol as Interface

from smartshoe.devices import Block, Shoe
from smartshoe.runs.session._checks import PressingFault


class Operator(Interface):
    """What a session asks of a person; all but `confirm` return at once."""

    def streams(self, shoe: Shoe) -> None:
        """The shoe is open, and read from here on."""

    def tell(self, sentence: str) -> None:
        """Say what happens, or what is to be done."""

    def confirm(self, sentence: str, meanwhile: Callable[[], None]) -> None:
        """Say what is to be done and come back when it has been done; ``meanwhile`` is to be called all the time."""

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        """Show readings that are on disk."""

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        """Whether the experiment is to be pressed again because of ``finding``."""


class Unattended:
    """Nobody is there: everything is confirmed, and what can be repeated is repeated."""

    def streams(self, shoe: Shoe) -> None:
        """Nobody looks."""

    def tell(self, sentence: str) -> None:
        """Nobody hears it."""

    def confirm(self, sentence: str, meanwhile: Callable[[], None]) -> None:
        """Taken as done."""

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        """Nobody looks."""

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        """As long as repeats are left."""
        return repeats_left > 0
