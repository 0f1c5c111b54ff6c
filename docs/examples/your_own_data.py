"""
2. Your own data
================

A file of your own: a logger's text with headings and units of its own. This page makes such a file first, so that it
can run; put the name of yours in its place.
"""

from pathlib import Path

import numpy as np

import smartshoe

with smartshoe.open_machine("sim:instron", unit="right_heel", seed=4) as machine:
    made = machine.run(smartshoe.dynamic_protocol((100.0, 400.0), repeats=2))

ours = np.column_stack([1000.0 * made.time_s, made.force_n / 1000.0, made.sensor.values / 10.0])
np.savetxt("bench_7.txt", ours, fmt="%.5f", delimiter="\t", header="t\tLoad\tP4", comments="")
print(Path("bench_7.txt").read_text()[:120])

# %%
# Say what is what
# ----------------
#
# Columns whose names give them away are found by themselves. Others are named, with the unit in brackets where the file
# does not say it; in a file without headings they are numbers, counted from 1. The command line takes the same words:
# ``smartshoe identify bench_7.txt --time 't[ms]' --force 'Load[kN]' --sensor 'P4[kPa]'``.
recording = smartshoe.read("bench_7.txt", time="t[ms]", force="Load[kN]", sensors=["P4[kPa]"])
print(recording)
print(f"{recording.force_n.max():.1f} N at most, {len(recording)} samples")

# %%
# Arrays and data frames go as well. Names carry the units.
again = smartshoe.Recording.from_arrays(
    time_s=recording.time_s, force_n=recording.force_n, pressure_kpa=recording.sensor.values, name="bench_7"
)
found = smartshoe.identify([again], direction="inverse")
print(found.summary())

# %%
# When something is wrong
# -----------------------
#
# One sentence says what, where, and how to mend it; on the command line it is the last line, without a traceback.
try:
    smartshoe.read("bench_7.txt", time="t[ms]", force="Lode[kN]", sensors=["P4[kPa]"])
except smartshoe.SmartShoeError as error:
    print(error)
