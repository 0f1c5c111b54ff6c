"""Section 9 of the contract: one page, its health, its socket; who is let in; a recording that is whole."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from serving import health, page, serving, told, until, walk_table
from websockets.exceptions import ConnectionClosed, InvalidStatus

import smartshoe
from smartshoe.cli import run_command
from smartshoe.live.server import LONGEST_MESSAGE

COMMAND = [sys.executable, "-m", "smartshoe.cli", "live"]


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return walk_table(tmp_path_factory.mktemp("walk") / "walk.csv")


def get(port: int, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0)
    connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
    answer = connection.getresponse()
    found = answer.status, answer.read(), {name.lower(): value for name, value in answer.getheaders()}
    connection.close()
    return found


def test_the_page_needs_no_other_host_and_health_says_what_the_contract_says(walk: Path) -> None:
    with serving(f"replay:{walk}", speed=4.0) as (server, session):
        status, body, headers = get(server.port, "/")
        assert status == 200
        assert headers["content-type"].startswith("text/html")
        text = body.decode()
        assert not re.search(r"""(src|href)\s*=\s*["'](?!data:)""", text)
        assert not re.search(r"https?://", text)
        assert "default-src 'none'" in headers["content-security-policy"]
        until(lambda: session.shoes[0].state == "over")
        found = health(server)
        assert found["schema"] == "smartshoe.live/1"
        assert (found["samples"], found["lost"], found["rate_hz"], found["clients"]) == (2000, 0, 200.0, 0)
        assert found["recording"] is None
        assert found["clock"]["offset_ms"] == pytest.approx(0.0, abs=1e-3)
        assert found["clock"]["sd_ms"] == 0.0
        assert get(server.port, "/../pyproject.toml")[0] == 404
        assert get(server.port, "/live.js")[0] == 404


def test_only_our_own_page_may_ask(walk: Path) -> None:
    with serving(f"replay:{walk}") as (server, _):
        assert get(server.port, "/", Host="evil.example")[0] == 403
        assert get(server.port, "/health", Origin="http://evil.example")[0] == 403
        assert get(server.port, "/", Origin=f"http://127.0.0.1:{server.port}")[0] == 200
        for origin in (
            "http://evil.example",
            "null",
            f"http://127.0.0.1:{server.port + 1}",
            f"https://127.0.0.1:{server.port}",
        ):
            with pytest.raises(InvalidStatus, match="403"):
                page(server, origin=origin)
        with page(server, origin=f"http://127.0.0.1:{server.port}") as socket:
            assert told(socket, "hello")["shoes"]


def test_with_a_token_every_path_needs_it(walk: Path) -> None:
    with serving(f"replay:{walk}", token="mild blue") as (server, _):
        for path in ("/", "/health", "/nothing", "/health?token=", "/health?token=mild%20blu"):
            assert get(server.port, path)[0] == 401
        assert get(server.port, "/health?token=mild%20blue", Host="lab.example")[0] == 200
        assert get(server.port, "/", Authorization="Bearer mild blue")[0] == 200
        for query in ("", "?token=wrong"):
            with pytest.raises(InvalidStatus, match="403"):
                page(server, query)
        with page(server, "?token=mild+blue") as socket:
            told(socket, "hello")


def test_what_a_page_sends_is_bounded_and_read_as_data_only(walk: Path) -> None:
    with serving(f"replay:{walk}") as (server, session):
        with page(server) as socket:
            for wrong in ("", "[]", "[" * 3000, '{"do": "run"}', '{"do": ["view"]}', '"x"'):
                socket.send(wrong)
                assert told(socket, "refused")
            socket.send(b"\x00\xff")
            assert told(socket, "refused")
            socket.send(json.dumps({"do": "mark", "word": "<img src=x>\n\x00" + 200 * "a", "age_s": 1e300}))
            note = told(socket, "news", lambda m: m["notes"])["notes"][0]
            assert note["says"].startswith("<img src=x> a")
            assert len(note["says"]) <= 80
            socket.send(LONGEST_MESSAGE * 2 * "a")
            with pytest.raises(ConnectionClosed, match="1009"):
                told(socket, "nothing")
        assert session.recording is None


@pytest.mark.parametrize(
    "words", [["--host", "0.0.0.0"], ["--token", "x"], ["--host", "", "--token", "x"], ["--port", "0"]]
)
def test_a_wrong_command_line_is_told(words: list[str], walk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["live", "--shoe", f"replay:{walk}", *words]) == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_a_refused_command_leaves_no_file(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "out.csv")
    with serving(f"replay:{walk}") as (server, _):
        words = ["live", "--shoe", f"replay:{walk}", "--record"]
        assert run_command([*words, out, "--port", str(server.port)]) == 2
        assert "another --port" in capsys.readouterr().err
        assert run_command([*words, str(tmp_path / "no" / "out.csv")]) == 2
        assert run_command([*words, out, "--shoe", f"replay:{walk}?block_samples=10"]) == 2
        assert "both have a unit" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_command_prints_its_address_first_and_ends_with_a_whole_file(walk: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    words = [*COMMAND, "--shoe", f"replay:{walk}", "--record", str(out), "--speed", "3"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = re.fullmatch(r"live: http://127\.0\.0\.1:(\d+)/\n", process.stdout.readline())
        assert found is not None
        port = int(found[1])
        until(lambda: json.loads(get(port, "/health")[1])["recording"]["samples"] > 300)
        process.send_signal(signal.SIGINT)
        said, errors = process.communicate(timeout=20)
    assert process.returncode == 0, errors
    assert errors == ""
    written, played = smartshoe.read(out), smartshoe.read(walk)
    assert said == f"{out}: {len(written)} samples\n"
    assert len(written) > 300
    for name in played.channels:
        np.testing.assert_array_equal(written[name].values, played[name].values[: len(written)])
    np.testing.assert_array_equal(written.time_s, played.time_s[: len(written)])


def test_what_was_acknowledged_survives_a_kill_and_the_next_session_goes_on(walk: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    words = [*COMMAND, "--shoe", f"replay:{walk}", "--record", str(out), "--speed", "3"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        port = int(process.stdout.readline().rsplit(":", 1)[1].strip("/\n"))
        until(lambda: json.loads(get(port, "/health")[1])["samples"] > 300)
        acknowledged = json.loads(get(port, "/health")[1])["samples"]
        os.kill(process.pid, signal.SIGKILL)
    assert len(smartshoe.read(out)) >= acknowledged
    with out.open("a") as file:
        file.write("9.1,3.2")  # a row that a pulled plug tore
    with serving(f"replay:{walk}", record=out, speed=3.0) as (_, session):
        until(lambda: session.shoes[0].samples > 100)
        assert any("interrupted" in note["says"] and "out_2.csv" in note["says"] for note in session.notes)
    assert len(smartshoe.read(out)) >= acknowledged
    assert len(smartshoe.read(tmp_path / "out_2.csv")) > 100
    assert run_command(["live", "--shoe", f"replay:{walk}", "--record", str(tmp_path / "out_2.csv")]) == 2
