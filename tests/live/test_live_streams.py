"""Slow pages, two shoes, marks and zero, a shoe that goes away and comes back, an outlet."""

from __future__ import annotations

import json
import socket
import threading
from pathlib import Path

import numpy as np
import pytest
from serving import health, page, serving, told, until, walk_table

import smartshoe
from simulators.wire.firmware import Firmware
from simulators.wire.pty_line import PtyLine
from simulators.wire.serving import Emulator
from smartshoe.calibration import Calibration
from smartshoe.devices import open_shoe
from smartshoe.files.journal import read_journal
from smartshoe.live._frames import SECONDS, view_of
from smartshoe.units import MILLIBAR


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return walk_table(tmp_path_factory.mktemp("walk") / "walk.csv")


def numbers_of(frame: bytes, shoes: int = 1) -> list[dict[str, np.ndarray]]:
    """A frame's arrays, by the layout that smartshoe.live._frames documents."""
    assert (frame[0], frame[1]) == (1, shoes)
    found, at = [], 24
    for _ in range(shoes):
        c, n, f = np.frombuffer(frame, "<u4", 3, at)
        first = np.frombuffer(frame, "<f8", 1, at + 12)[0]
        at += 20
        parts = {}
        for name, kind, size in (
            ("place", "<i4", n), ("values", "<f4", c), ("feet", "<f4", 4 * f),
            ("low", "<f4", n * c), ("high", "<f4", n * c),
        ):  # fmt: skip
            parts[name] = np.frombuffer(frame, kind, size, at)
            at += 4 * size
        parts["place"] = parts["place"] + int(first)
        parts["low"], parts["high"] = parts["low"].reshape(n, c), parts["high"].reshape(n, c)
        found.append(parts)
    assert at == len(frame)
    return found


def test_a_page_that_comes_late_gets_the_whole_picture_and_each_column_is_its_samples(walk: Path) -> None:
    played = smartshoe.read(walk)
    with serving(f"replay:{walk}", speed=20.0) as (server, session):
        until(lambda: session.shoes[0].state == "over")
        session.mark("before")
        with page(server) as client:
            hello = told(client, "hello")
            assert [note["says"] for note in hello["notes"]] == ["before"]
            assert len(hello["steps"]) > 30
            while not isinstance(frame := client.recv(timeout=30.0), bytes):
                pass
            shoe = numbers_of(frame)[0]
            width_s = hello["view"]["seconds"] / hello["view"]["columns"]
            heel = hello["shoes"][0]["names"].index("left_heel")
            places = np.floor(played.time_s / width_s + 1e-9).astype(int)
            assert set(shoe["place"]) <= set(places.tolist())
            assert len(shoe["place"]) > 290
            for k in range(0, len(shoe["place"]), 40):
                inside = played["left_heel"].values[
                    np.abs(played.time_s - (shoe["place"][k] + 0.5) * width_s) <= width_s
                ]
                assert inside.min() - 1e-4 <= shoe["low"][k, heel] <= shoe["high"][k, heel] <= inside.max() + 1e-4
            assert float(shoe["low"][:, heel].min()) == pytest.approx(played["left_heel"].values.min(), rel=1e-6)
            assert float(shoe["high"][:, heel].max()) == pytest.approx(played["left_heel"].values.max(), rel=1e-6)


def test_pages_that_do_not_read_lose_no_sample_and_slow_no_other_page(walk: Path) -> None:
    with serving(f"replay:{walk}", speed=4.0) as (server, session):
        stuck = []
        for _ in range(10):
            raw = socket.create_connection(("127.0.0.1", server.port))
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            raw.sendall(
                f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
            )
            assert raw.recv(1)  # and then nothing more
            stuck.append(raw)
        with page(server) as client:
            client.send(json.dumps({"do": "view", "seconds": 60, "columns": 1600}))
            frames = 0
            while session.shoes[0].state != "over":
                frames += isinstance(client.recv(timeout=30.0), bytes)
            assert health(server)["samples"] == 2000
            assert health(server)["clients"] == 11
            assert frames > 30
        for raw in stuck:
            raw.close()


@pytest.mark.parametrize("seconds", [0, 7, 30, 1e9, float("nan"), None, "5", True])
@pytest.mark.parametrize("columns", [-1, 640, 1e12, float("inf"), None, []])
def test_whatever_view_is_asked_for_is_one_of_few(seconds: object, columns: object) -> None:
    view = view_of(seconds, columns)
    assert view.seconds in SECONDS
    assert view.columns % 100 == 0
    assert 100 <= view.columns <= 1600


def test_two_shoes_are_recorded_on_one_clock_with_marks_and_zero_beside(tmp_path: Path) -> None:
    left = walk_table(tmp_path / "a.csv", 6.0, ("left",))
    right = walk_table(tmp_path / "b.csv", 6.0, ("right",))
    out = tmp_path / "out.csv"
    urls = f"replay:{left}", f"replay:{right}"
    with serving(*urls, record=out, speed=6.0) as (server, session):  # noqa: SIM117  the page goes first
        with page(server) as client:
            assert len(told(client, "hello")["shoes"]) == 2
            until(lambda: all(live.samples for live in session.shoes))
            client.send(json.dumps({"do": "mark", "word": "turn", "age_s": 0.0}))
            told(client, "news", lambda m: any(n["kind"] == "mark" for n in m["notes"]))
            client.send(json.dumps({"do": "zero"}))
            told(client, "news", lambda m: any(n["kind"] == "no_zero" for n in m["notes"]))
            until(lambda: all(live.state == "over" for live in session.shoes))
            until(lambda: health(server)["samples"] == 2400)
            client.send(json.dumps({"do": "record", "on": False}))
            told(client, "state", lambda m: m["recording"] is None)
            client.send(json.dumps({"do": "record"}))
            again = told(client, "state", lambda m: m["recording"] is not None)
            assert again["recording"]["file"] == "out_2.csv"
    notes = [json.loads(record.payload) for record in read_journal(tmp_path / "out.csv.smj").records]
    marks = [note for note in notes if note.get("kind") == "mark"]
    assert [mark["says"] for mark in marks] == ["turn"]
    for side, number in (("left", 0), ("right", 1)):
        found, played = smartshoe.read(tmp_path / f"out_{side}.csv"), smartshoe.read((left, right)[number])
        np.testing.assert_array_equal(found["device_time"].values, played.time_s)
        np.testing.assert_allclose(found.time_s, played.time_s, atol=1e-9)
        np.testing.assert_array_equal(found[f"{side}_heel"].values, played[f"{side}_heel"].values)
        assert 0.0 <= marks[0]["device_time_s"][number] <= 6.5


def test_calibrated_units_are_shown_and_recorded_as_the_force_that_compensate_gives(walk: Path, tmp_path: Path) -> None:
    calibration = Calibration(0.3, 5.0, 2.5, MILLIBAR, unit="left_heel")
    out = tmp_path / "out.csv"
    with serving(f"replay:{walk}", record=out, speed=20.0, calibrations=[calibration]) as (_, session):
        assert session.shoes[0].symbols[3] == "N"
        until(lambda: session.shoes[0].state == "over")
    played = smartshoe.read(walk)
    expected = calibration.compensator(200.0).apply(played["left_heel"].values)
    np.testing.assert_allclose(smartshoe.read(out)["left_heel_force_estimate"].values, expected, atol=1e-9)


def test_an_unloaded_foot_is_zeroed_in_the_traces_that_are_there_already(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    names = ("toe", "meta1", "meta4", "heel")
    table = np.column_stack([np.arange(800) / 200.0, 1.5 + 0.02 * rng.normal(size=(800, 4))])
    path = tmp_path / "rest.csv"
    header = ",".join(["time_s", *(f"left_{name}_mbar" for name in names)])
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    with serving(f"replay:{path}", speed=20.0) as (server, session), page(server) as client:
        until(lambda: session.shoes[0].state == "over")
        client.send(json.dumps({"do": "zero"}))
        told(client, "news", lambda m: any(n["kind"] == "zero" for n in m["notes"]))
        while not isinstance(frame := client.recv(timeout=30.0), bytes):
            pass
        assert len(numbers_of(frame)[0]["place"]) > 50
        assert np.abs(numbers_of(frame)[0]["high"]).max() < 0.1


@pytest.mark.wire
def test_a_shoe_that_goes_away_is_shown_and_comes_back(tmp_path: Path) -> None:
    walk = walk_table(tmp_path / "walk.csv", 30.0, ("left",))
    line = PtyLine(tmp_path / "shoe0")

    def emulate(stop: threading.Event) -> threading.Thread:
        emulator = Emulator(Firmware(open_shoe(f"replay:{walk}")), line)
        line.appear()
        thread = threading.Thread(target=emulator.run, args=(stop,))
        thread.start()
        return thread

    stop = threading.Event()
    thread = emulate(stop)
    try:
        with serving(f"serial://{line.link}?give_up_s=0.6&silence_s=0.2", record=tmp_path / "out.csv") as (
            server,
            session,
        ):
            live = session.shoes[0]
            until(lambda: live.samples > 50)
            stop.set()
            thread.join()
            until(lambda: live.state == "away")
            before = live.samples
            with page(server) as client:
                assert told(client, "state", lambda m: m["shoes"][0]["state"] == "away")
            stop = threading.Event()
            thread = emulate(stop)
            until(lambda: live.state == "streaming" and live.samples > before + 50)
            kinds = {note["kind"] for note in session.notes}
            assert {"disconnected", "reconnected"} <= kinds
            assert health(server)["clock"]["sd_ms"] is not None
    finally:
        stop.set()
        thread.join()
    assert (np.diff(smartshoe.read(tmp_path / "out.csv").time_s) > 0.0).all()


def test_an_outlet_carries_names_units_and_every_sample(walk: Path) -> None:
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError):
        pytest.skip("liblsl cannot be loaded here")
    with serving(f"replay:{walk}", lsl=True, speed=2.0) as (_, session):
        found = pylsl.resolve_byprop("source_id", f"smartshoe:replay:{walk}", timeout=30.0)
        if not found:
            pytest.skip("this network lets no stream be found")
        inlet = pylsl.StreamInlet(found[0])
        inlet.open_stream(timeout=30.0)
        description = inlet.info(timeout=30.0).desc().child("channels").first_child()
        assert description.child_value("label") == "left_toe"
        assert description.child_value("unit") == "mbar"
        rows: list[list[float]] = []
        until(lambda: rows.extend(inlet.pull_chunk(timeout=0.1)[0]) or session.shoes[0].state == "over")
        time_s = np.array([row[-1] for row in rows])
        assert time_s.size > 500
        np.testing.assert_allclose(np.diff(time_s), 0.005, atol=1e-9)
