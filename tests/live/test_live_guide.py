"""A calibration session on the live page: its instruction stands there, its readings move, its answer is taken."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import pytest
from serving import told, walk_table
from websockets.sync.client import connect

from smartshoe.devices import open_shoe
from smartshoe.live._guidance import Guidance
from smartshoe.live.guide import AGAIN, DONE, PageOperator
from smartshoe.protocol import Protocol, dynamic_protocol
from smartshoe.runs.session import PressingFault, SessionPlan, Unattended

SHORT = Protocol("short", dynamic_protocol((200.0, 800.0), rest_s=2.0).segments)


class _Watched(Unattended):
    def __init__(self) -> None:
        self.told: list[str] = []

    def tell(self, sentence: str) -> None:
        self.told.append(sentence)


def test_the_page_shows_what_is_to_be_done_and_its_button_is_the_answer(tmp_path: Path) -> None:
    walk = walk_table(tmp_path / "walk.csv", 20.0, ("left",))
    plan = SessionPlan(
        shoe=f"replay:{walk}", machine="log:x", unit="left_toe", protocols=(SHORT,), created="2026-01-01"
    )
    addresses: list[str] = []
    other = _Watched()
    with (
        PageOperator(other, plan, addresses.append, asks=True, keyboard=False) as operator,
        open_shoe(plan.shoe) as shoe,
    ):
        operator.streams(shoe)
        blocks = shoe.blocks()
        operator.show(next(blocks), "", 0.0)
        for elapsed_s, block in zip((1.0, 2.0, 3.0), blocks, strict=False):
            operator.show(block, "short", elapsed_s)
        meanwhile = threading.Event()
        asking = threading.Thread(target=operator.confirm, args=("put left_toe under the anvil", meanwhile.set))
        asking.start()
        with connect(f"{addresses[0].replace('http', 'ws')}ws") as page:
            asked = told(page, "task", lambda task: task["answers"])
            assert asked["says"] == "put left_toe under the anvil"
            assert asked["answers"] == [DONE]
            assert (asked["experiment"], asked["elapsed_s"], asked["duration_s"]) == ("short", 3.0, SHORT.duration_s)
            page.send(json.dumps({"do": "answer", "question": asked["question"], "answer": "Perhaps"}))
            assert "nobody waits" in told(page, "refused")["says"]
            assert asking.is_alive()
            page.send(json.dumps({"do": "answer", "question": asked["question"], "answer": DONE}))
            asking.join(30.0)
            assert not asking.is_alive()
            assert meanwhile.is_set()  # the stream was read on while the page was waited for
            assert told(page, "task", lambda task: not task["answers"])
            fault = PressingFault("unloaded", "the unit's reading does not rise at all")
            wanted: list[bool] = []
            asking = threading.Thread(target=lambda: wanted.append(operator.wants_repeat(fault, 2)))
            asking.start()
            asked = told(page, "task", lambda task: task["answers"])
            page.send(json.dumps({"do": "answer", "question": asked["question"], "answer": AGAIN}))
            asking.join(30.0)
            assert wanted == [True]
            operator.tell("stop the test on the machine")
            assert told(page, "news", lambda news: any(note["says"].startswith("stop") for note in news["notes"]))
            assert told(page, "task", lambda task: task["says"].startswith("stop"))
    assert other.told == ["stop the test on the machine"]


def test_only_the_first_answer_to_the_question_that_stands_is_taken() -> None:
    task = Guidance()
    assert not task.take(0, DONE)
    task.ask("now?", (DONE, AGAIN))
    assert not task.take(0, DONE)
    assert task.take(1, DONE)
    assert not task.take(1, AGAIN)
    assert task.answer == DONE
    task.ask("and now?", (DONE,))
    assert task.answer is None
    assert not task.take([1], {"a": 1})


@pytest.mark.parametrize("repeats", [0, 2])
def test_nobody_is_asked_where_nobody_is_there(repeats: int) -> None:
    plan = SessionPlan(shoe="sim:stand", machine="sim:instron", unit="left_toe", protocols=(SHORT,))
    with PageOperator(_Watched(), plan, print, asks=False, keyboard=False) as operator:
        operator.confirm("put it there", lambda: None)
        fault = PressingFault("unloaded", "the unit's reading does not rise at all")
        assert operator.wants_repeat(fault, repeats) is (repeats > 0)
