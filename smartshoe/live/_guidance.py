"""`Guidance`: the instructions and questions of a calibration session, as shown on a page, and the page's answers."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock
from typing import Any

PROGRESS_STEP_S = 0.2


class Guidance:
    """The current instruction, the progress of the pressing, and the answer to a question; safe to use from any thread.

    ``version`` increases with each change that a page has to show.
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
        """Set the sentence that is shown from now on."""
        with self._lock:
            self._says = says
            self.version += 1

    def progress(self, experiment: str, elapsed_s: float, duration_s: float) -> None:
        """Report ``elapsed_s`` of a pressing of ``duration_s``; ``experiment`` is empty if nothing is pressed."""
        with self._lock:
            if experiment == self._experiment and abs(elapsed_s - self._elapsed_s) < PROGRESS_STEP_S:
                return
            self._experiment, self._elapsed_s, self._duration_s = experiment, elapsed_s, duration_s
            self.version += 1

    def ask(self, says: str, answers: Sequence[str]) -> None:
        """Ask a question with its possible ``answers``; `answer` is None until one of them is given."""
        with self._lock:
            self._says, self._answers, self._answer = says, tuple(answers), None
            self._question += 1
            self.version += 1

    @property
    def answer(self) -> str | None:
        """The answer to the current question; None if it was not answered yet."""
        with self._lock:
            return self._answer

    def take(self, question: object, answer: object) -> bool:
        """Take a page's answer to the question of that number; returns whether that answer was expected."""
        with self._lock:
            if question != self._question or answer not in self._answers or self._answer is not None:
                return False
            self._answer = str(answer)
            return True

    def settle(self) -> None:
        """Withdraw the question, since it was answered here or elsewhere."""
        with self._lock:
            self._answers = ()
            self.version += 1

    def to_dict(self) -> dict[str, Any]:
        """The current state as the message for a page."""
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
