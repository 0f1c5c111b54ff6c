"""How long to wait before a lost port is tried again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Backoff:
    """Waits that double from ``first_s`` to ``longest_s``; a success starts them over."""

    first_s: float = 0.1
    longest_s: float = 2.0
    attempts: int = 0

    def next_wait_s(self) -> float:
        """The wait before the next attempt, which is counted."""
        # The exponent is bounded: a power of two beyond any float would raise.
        wait_s = min(self.first_s * 2.0 ** min(self.attempts, 60), self.longest_s)
        self.attempts += 1
        return wait_s

    def reset(self) -> None:
        """After a success."""
        self.attempts = 0
