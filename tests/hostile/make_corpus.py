"""Writes the corpus of broken files: ``python tests/hostile/make_corpus.py tests/hostile/corpus``.

Small files of every format, each with one thing wrong that once ended in a traceback, a hang, gigabytes, or another
file's content. `test_corpus.EXPECTED` says how each is refused.
"""

from __future__ import annotations

import json
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from nptdms import ChannelObject, RootObject, TdmsWriter
from scipy.io import savemat

COUNT = 16
TIME_S = np.arange(COUNT) * 0.01
LONG = "9" * 400


def _hdf5(path: Path, add: Callable[[h5py.File], Any]) -> None:
    with h5py.File(path, "w", track_order=True) as file:
        file.create_dataset("time", data=TIME_S, track_times=False).attrs["units"] = "s"
        add(file)


def _virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((COUNT,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", (COUNT,))
    file.create_virtual_dataset("pressure", layout)


def _own(**changed: Any) -> Callable[[h5py.File], None]:
    about = {"schema": "smartshoe.recording/1", "name": "x", "metadata": "{}", "channels": '["force"]', **changed}

    def add(file: h5py.File) -> None:
        file["force"] = TIME_S
        file["force"].attrs.update({"units": "N", "role": "load"})
        for key, value in about.items():
            file.attrs[key] = value

    return add


def hdf5_files(folder: Path) -> None:
    """Data that lie elsewhere, sizes that are not true, our own attributes of wrong types."""
    _hdf5(folder / "external_storage.h5",
          lambda f: f.create_dataset("pressure", (COUNT,), dtype="u1", external=[("other.bin", 0, COUNT)]))  # fmt: skip
    _hdf5(folder / "external_link.h5", lambda f: f.__setitem__("pressure", h5py.ExternalLink("other.h5", "/x")))
    _hdf5(folder / "virtual.h5", _virtual)
    _hdf5(folder / "eleven_gigabytes.h5",
          lambda f: f.create_dataset("pressure", (1_400_000_000,), dtype="f8", chunks=(1000,)))  # fmt: skip
    _hdf5(folder / "metadata_a_list.h5", _own(metadata="[1, 2]"))
    _hdf5(folder / "metadata_no_json.h5", _own(metadata="{"))
    _hdf5(folder / "channels_a_number.h5", _own(channels="5"))
    _hdf5(folder / "name_an_array.h5", _own(name=np.arange(4)))
    whole = (folder / "metadata_a_list.h5").read_bytes()
    # A driver's block is named where there is none: its length is what stands there, 4 GB.
    driver = (
        whole[:48] + struct.pack("<Q", len(whole)) + whole[56:] + b"\0\0\0\0\xff\xff\xff\xffNCSAmult".ljust(64, b"\0")
    )
    (folder / "driver_of_four_gigabytes.h5").write_bytes(driver)
    (folder / "truncated.h5").write_bytes(whole[: len(whole) // 2])


def _element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def _matrix(class_: int, body: bytes, name: bytes = b"", shape: tuple[int, int] = (1, 1)) -> bytes:
    head = _element(6, struct.pack("<II", class_, 0)) + _element(5, struct.pack("<2i", *shape)) + _element(1, name)
    return _element(14, head + body)


def mat_files(folder: Path) -> None:
    """Cells in cells, what unpacks to far more, cells that are not there, our own text of wrong types."""
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    inner = _matrix(6, _element(9, struct.pack("<d", 1.0)))
    for _ in range(20_000):
        inner = _matrix(1, inner)
    packed = zlib.compress(_matrix(1, inner, b"x"), 9)
    (folder / "cells_in_cells.mat").write_bytes(header + struct.pack("<II", 15, len(packed)) + packed)
    zeros = _matrix(6, _element(9, bytes(40 << 20)), b"x", (5 << 20, 1))
    packed = zlib.compress(zeros, 9)
    (folder / "unpacks_to_forty_megabytes.mat").write_bytes(header + struct.pack("<II", 15, len(packed)) + packed)
    (folder / "cells_that_are_not_there.mat").write_bytes(header + _matrix(1, inner[:64], b"x", (2_000_000_000, 1)))
    for name, about in {"smartshoe_a_number": 5.0, "smartshoe_a_list": "[1]", "smartshoe_no_text_for_a_name":
                        json.dumps({"name": 5, "unit": [], "metadata": {"a": 1}, "columns": {}})}.items():  # fmt: skip
        savemat(folder / f"{name}.mat", {"time_s": TIME_S[:, None], "force_n": TIME_S[:, None], "smartshoe": about})
    whole = (folder / "smartshoe_a_list.mat").read_bytes()
    (folder / "truncated.mat").write_bytes(whole[: len(whole) - 50])


def tdms_files(folder: Path) -> None:
    """Cut, with counts that are not true, with properties of wrong types."""
    path = folder / "properties_of_wrong_types.tdms"
    properties = {"wf_increment": "fast", "smartshoe_role": 5}
    with TdmsWriter(path) as writer:
        writer.write_segment([RootObject({}), ChannelObject("g", "force", TIME_S, properties)])
    with TdmsWriter(folder / "whole") as writer:
        writer.write_segment([RootObject({}), ChannelObject("g", "time", TIME_S, {"unit_string": "s"})])
    whole = (folder / "whole").read_bytes()
    (folder / "whole").unlink()
    (folder / "truncated_header.tdms").write_bytes(whole[:60])
    index = struct.pack("<IIQ", 10, 1, COUNT)  # type, dimension, values
    (folder / "many_values.tdms").write_bytes(whole.replace(index, struct.pack("<IIQ", 10, 1, 1 << 40)))
    name = b"/'g'/'time'"
    long_name = struct.pack("<I", 0xFFFFFFF0) + name
    (folder / "long_names.tdms").write_bytes(whole.replace(struct.pack("<I", len(name)) + name, long_name))
    (folder / "odd_type.tdms").write_bytes(whole.replace(struct.pack("<I", 10), struct.pack("<I", 0x7777), 1))


LVM = "LabVIEW Measurement\t\n***End_of_Header***\t\nChannels\t{}\n***End_of_Header***\nX\tY\n"
TEXTS = {
    "five_thousand_columns.csv": ",".join(["time_s", *(f"c{n}" for n in range(5000))]) + "\n",
    "beyond_any_number.csv": "time_s,force_n\n0,1\n1,1e300\n",
    "zeros.csv": "time_s,force_n\n0,1\n\0\0,2\n",
    "time_goes_back.csv": "time_s,force_n\n1,1\n0,1\n",
    "no_rows.csv": "time_s,force_n\n",
    "two_times.csv": "time_s,time_s\n0,1\n1,2\n",
    "open_quote.csv": 'time_s,force_n\n0,"1\n1,2\n',
    "no_role.csv": "# role force_n: king\ntime_s,force_n\n0,1\n1,2\n",
    "blanks.csv": " \n\n \n",
    "no_end_of_header.lvm": "LabVIEW Measurement\t\nSeparator\tTab\n",
    "a_billion_channels.lvm": LVM.format(1_000_000_000) + "0\t1\n",
    "cells_no_numbers.lvm": LVM.format(1) + "0\tone\n",
    "no_samples.lvm": LVM.format(1),
    "bluehill_mixed_marks.csv": "Time,Load\n(s),(N)\n0.5,1\n1,\"2,5\"\n",
    "bluehill_no_rows.csv": "Time;Load\n(s);(N)\n",
    "no_table.txt": "There is nothing but a sentence here.\nAnd another one.\n",
}  # fmt: skip
CALIBRATIONS = {
    "digits": {"a1": "DIGITS"},
    "nothing": {},
    "text": {"a1": "much"},
    "nan": {"a1": "NAN"},
    "depth": {"sources": "DEPTH"},
}
UNIT = '[protocol.dynamic]\n[[unit]]\nname = "{}"\n'
SCENARIOS = {
    "name_leads_out.toml": UNIT.format("../../left_toe"),
    "name_absolute.toml": UNIT.format("/left_toe"),
    "name_of_a_device.toml": UNIT.format("NUL"),
    "protocol_leads_out.toml": '[protocol."../x"]\nkind = "dynamic"\n[[unit]]\nname = "left_toe"\n',
    "unit_under_machine.toml": '[machine]\nunit = "left_toe"\n' + UNIT.format("left_toe"),
    "seed_under_unit.toml": UNIT.format("left_toe") + "seed = 5\n",
    "url_under_machine.toml": '[machine]\nurl = "x"\n' + UNIT.format("left_toe"),
    "protocol_no_table.toml": 'protocol = 5\n[[unit]]\nname = "left_toe"\n',
    "repeats_without_bound.toml": "[protocol.dynamic]\nrepeats = 1000000000\n[[unit]]\nname = 'left_toe'\n",
    "years.toml": '[protocol.x]\nkind = "segments"\ncorners = [[0, 0], [1e12, 5]]\n[[unit]]\nname = "left_toe"\n',
    "infinite.toml": '[protocol.dynamic]\npeak_n = inf\n[[unit]]\nname = "left_toe"\n',
    "digits.toml": f"seed = {'9' * 5000}\n" + UNIT.format("left_toe"),
    "nested.toml": "a = " + "[" * 3000 + "]" * 3000 + "\n",
}


def text_files(folder: Path) -> None:
    """Tables, calibrations and scenarios."""
    for name, text in {**TEXTS, **SCENARIOS}.items():
        (folder / name).write_bytes(text.encode())
    for name, model in CALIBRATIONS.items():
        text = json.dumps({"schema": "smartshoe.calibration/1", "model": {"kind": "first_order", **model}})
        text = text.replace('"DIGITS"', LONG).replace('"NAN"', "NaN").replace('"DEPTH"', "[" * 5000 + "]" * 5000)
        (folder / f"calibration_{name}.json").write_text(text)


def main(folder: Path) -> None:
    """Write every file anew."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in (hdf5_files, mat_files, tdms_files, text_files):
        make(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
