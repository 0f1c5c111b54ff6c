"""`Operator`: the person at the machine, who gets instructions and gives confirmations and decisions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol as Interface

from smartshoe.devices import Block, Shoe
from smartshoe.runs.session._checks import PressingFault


class Operator(Interface):
    """What a session asks of a person; all methods but `confirm` return at once."""

    def streams(self, shoe: Shoe) -> None:
        """Called when the shoe is open, before its stream is read."""

    def tell(self, sentence: str) -> None:
        """Show a sentence: what happens, or what is to be done."""

    def confirm(self, sentence: str, meanwhile: Callable[[], None]) -> None:
        """Ask for something to be done and return when it is; ``meanwhile`` must be called repeatedly until then."""

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        """Show readings that are already on disk."""

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        """Whether to press the experiment again because of ``finding``."""


class Unattended:
    """An operator without a person: confirms everything, and repeats an experiment as long as that is allowed."""

    def streams(self, shoe: Shoe) -> None:
        """Do nothing."""

    def tell(self, sentence: str) -> None:
        """Do nothing."""

    def confirm(self, sentence: str, meanwhile: Callable[[], None]) -> None:
        """Confirm at once."""

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        """Do nothing."""

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        """True as long as repeats are left."""
        return repeats_left > 0
