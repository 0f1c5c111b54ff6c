"""What a calibration session asks of the person at the machine, as a page shows it, and what the page answers."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock
from typing import Any

PROGRESS_STEP_S = 0.2


class Guidance:
    """The sentence that stands, how far the pressing is, and an answer where one is waited for; for any thread.

    ``version`` rises with each change that a page is to show.
    """

    def __init__(self) -> None:
        self.version = 0
        self._lock = Lock()
        self._says = ""
        self._experiment = ""
        self._elapsed_s = self._duration_s = 0.0
        self._answers: tuple[str, ...] = ()
        self._question = 0
        self._answer: str | None = None

    def tell(self, says: str) -> None:
        """The sentence that stands from now on."""
        with self._lock:
            self._says = says
            self.version += 1

    def progress(self, experiment: str, elapsed_s: float, duration_s: float) -> None:
        """``elapsed_s`` of a pressing of ``duration_s``; an empty name where nothing is pressed."""
        with self._lock:
            if experiment == self._experiment and abs(elapsed_s - self._elapsed_s) < PROGRESS_STEP_S:
                return
            self._experiment, self._elapsed_s, self._duration_s = experiment, elapsed_s, duration_s
            self.version += 1

    def ask(self, says: str, answers: Sequence[str]) -> None:
        """Put a question with its ``answers``; `answer` is None until one of them is given."""
        with self._lock:
            self._says, self._answers, self._answer = says, tuple(answers), None
            self._question += 1
            self.version += 1

    @property
    def answer(self) -> str | None:
        """What was answered to the question that stands."""
        with self._lock:
            return self._answer

    def take(self, question: object, answer: object) -> bool:
        """An answer of a page to the question of that number; whether it was one that is waited for."""
        with self._lock:
            if question != self._question or answer not in self._answers or self._answer is not None:
                return False
            self._answer = str(answer)
            return True

    def settle(self) -> None:
        """The question is answered, here or elsewhere: nothing is asked."""
        with self._lock:
            self._answers = ()
            self.version += 1

    def to_dict(self) -> dict[str, Any]:
        """The message that a page gets."""
        with self._lock:
            return {
                "type": "task",
                "says": self._says,
                "experiment": self._experiment,
                "elapsed_s": round(min(self._elapsed_s, self._duration_s), 1),
                "duration_s": round(self._duration_s, 1),
                "question": self._question,
                "answers": list(self._answers),
            }
