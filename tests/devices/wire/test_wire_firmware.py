"""The firmware in docs/wire.md: its C is compiled, run, and read by the decoders."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from smartshoe.devices.wire._commands import Command, CommandDecoder, encode_command
from smartshoe.devices.wire.frames import FrameDecoder, encode_information, encode_samples
from smartshoe.devices.wire.information import ChannelInformation, Information

MAIN = """
#include <stdio.h>
#include "shoe_wire.h"
int main(void) {
    static uint8_t frame[SHOE_LONGEST_FRAME];
    static char text[700];
    shoe_listener listener = {{0}, 0};
    unsigned sequence, readings[4];
    unsigned long us, length;
    char what;
    while (scanf(" %c", &what) == 1) {
        if (what == 's') {
            uint16_t counts[4];
            if (scanf("%u %lu", &sequence, &us) != 2) return 1;
            for (int unit = 0; unit < 4; unit++) {
                if (scanf("%u", readings + unit) != 1) return 1;
                counts[unit] = (uint16_t)readings[unit];
            }
            fwrite(frame, 1, shoe_sample(frame, (uint16_t)sequence, (uint32_t)us, counts), stdout);
        } else if (what == 'i') {
            if (scanf(" %699[^\\n]", text) != 1) return 1;
            fwrite(frame, 1, shoe_information(frame, text), stdout);
        } else {
            if (scanf("%lu", &length) != 1) return 1;
            while (length--) {
                unsigned byte;
                uint32_t millihertz = 0;
                if (scanf("%x", &byte) != 1) return 1;
                uint8_t command = shoe_listen(&listener, (uint8_t)byte, &millihertz);
                if (command) printf("%02X %lu\\n", command, (unsigned long)millihertz);
            }
        }
    }
    return 0;
}
"""

ARDUINO = """
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstring>
static uint32_t now_us = 1000;
inline uint32_t micros() { return now_us; }
inline int analogRead(int pin) { return pin * 10; }
struct Port {
    const uint8_t *in = nullptr;
    int left = 0;
    void begin(long) {}
    int available() { return left; }
    int read() { left--; return *in++; }
    int availableForWrite() { return 128; }
    size_t write(const uint8_t *data, size_t size) { return fwrite(data, 1, size, stdout); }
};
static Port Serial;
"""

BOARD = """
#include "sketch.h"
int main(int, char **argv) {
    FILE *host = fopen(argv[1], "rb");
    static uint8_t bytes[1000];
    int size = (int)fread(bytes, 1, sizeof bytes, host);
    setup();
    for (int tick = 0; tick < 20000; tick++) {
        if (tick == 100) { Serial.in = bytes; Serial.left = size; }
        loop();
        now_us += 100;
    }
    return 0;
}
"""

STRICT = ["-Wall", "-Wextra", "-Werror", "-fsanitize=undefined", "-O1"]


def _blocks(root: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (root / "docs" / "wire.md").read_text(encoding="utf-8"), re.DOTALL)


def _compiler(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"no {name}")
    return found


@pytest.fixture(scope="module")
def program(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = _compiler("gcc")
    folder = tmp_path_factory.mktemp("firmware")
    (folder / "shoe_wire.h").write_text(_blocks(root, "c")[0])
    (folder / "main.c").write_text(MAIN)
    subprocess.run([compiler, "-std=c99", *STRICT, "main.c", "-o", "device"], cwd=folder, check=True)
    return folder / "device"


def _run(program: Path, asked: str) -> bytes:
    return subprocess.run([program], input=asked.encode(), capture_output=True, check=True).stdout


def test_its_sample_frames_are_ours(program: Path) -> None:
    rng = np.random.default_rng(4)
    n = 500
    count, clock = rng.integers(0, 2**16, n), rng.integers(0, 2**32, n)
    readings = rng.integers(0, 65536, (n, 4)) * rng.integers(0, 2, (n, 4))
    readings[readings == 65535] = 0
    asked = "".join(f"s {c} {t} {' '.join(map(str, r))}\n" for c, t, r in zip(count, clock, readings, strict=True))
    assert _run(program, asked) == encode_samples(count, clock, readings)


@pytest.mark.parametrize("length", [1, 150, 151, 152, 153, 154, 155, 156, 157, 158, 159, 160, 300])
def test_its_information_frames_are_ours(program: Path, length: int) -> None:
    # Lengths about 254 bytes of payload, where COBS begins another block.
    information = Information("f", "s" * length, 200.0, (ChannelInformation("toe", "mbar", 0.0, 100.0),), 4095)
    frame = _run(program, f"i {information.to_text()}\n")
    assert frame == encode_information(information)
    decoder = FrameDecoder()
    decoder.feed(frame)
    assert decoder.information == information
    assert _run(program, f"i {'x' * 481}\n") == b""


def test_it_hears_what_our_decoder_hears(program: Path) -> None:
    rng = np.random.default_rng(8)
    data = b""
    for _ in range(200):
        kind = ("start", "stop", "information", "rate")[rng.integers(4)]
        frame = bytearray(
            encode_command(Command(kind, float(rng.integers(1, 10**6)) / 1000 if kind == "rate" else None))
        )
        if rng.random() < 0.3:
            frame[rng.integers(len(frame))] ^= 1 << int(rng.integers(8))
        data += bytes(frame) + (rng.bytes(int(rng.integers(30))) if rng.random() < 0.3 else b"")
    said = [line.split() for line in _run(program, f"c {len(data)} {data.hex(' ')}\n").decode().splitlines()]
    kinds = {"81": "start", "82": "stop", "83": "rate", "84": "information"}
    heard = [Command(kinds[t], int(mhz) / 1000 if t == "83" else None) for t, mhz in said]  # type: ignore[arg-type]
    assert len(heard) > 100
    assert heard == CommandDecoder().feed(data)


def test_the_sketch_obeys_and_streams(root: Path, tmp_path: Path) -> None:
    compiler = _compiler("g++")
    (tmp_path / "shoe_wire.h").write_text(_blocks(root, "c")[0])
    (tmp_path / "Arduino.h").write_text(ARDUINO)
    (tmp_path / "sketch.h").write_text(_blocks(root, "cpp")[0])
    (tmp_path / "board.cpp").write_text(BOARD)
    (tmp_path / "commands").write_bytes(
        encode_command(Command("information"))
        + encode_command(Command("rate", 100.0))
        + encode_command(Command("start"))
    )
    subprocess.run([compiler, "-std=c++11", *STRICT, "-I.", "board.cpp", "-o", "board"], cwd=tmp_path, check=True)
    sent = subprocess.run([tmp_path / "board", "commands"], cwd=tmp_path, capture_output=True, check=True).stdout
    decoder = FrameDecoder()
    got = decoder.feed(sent)
    assert decoder.counters.information == 3
    assert decoder.information is not None
    assert decoder.information.rate_hz == 100.0
    assert got.sequence.tolist() == list(range(199))
    assert got.readings[0].tolist() == [320.0, 330.0, 340.0, 350.0]
    assert np.diff(got.device_time_s) == pytest.approx(np.full(198, 0.01))
    assert decoder.counters.bad == 0
