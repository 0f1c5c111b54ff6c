"""The waiting time between attempts to reopen a lost port."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Backoff:
    """Waiting times that double from ``first_s`` up to ``longest_s``; `reset` starts over."""

    first_s: float = 0.1
    longest_s: float = 2.0
    attempts: int = 0

    def next_wait_s(self) -> float:
        """The waiting time in s before the next attempt, which this call counts."""
        # The exponent is bounded: a power of two beyond any float would raise.
        wait_s = min(self.first_s * 2.0 ** min(self.attempts, 60), self.longest_s)
        self.attempts += 1
        return wait_s

    def reset(self) -> None:
        """Start again from ``first_s``, after a successful attempt."""
        self.attempts = 0
