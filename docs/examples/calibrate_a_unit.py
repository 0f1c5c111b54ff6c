"""
1. Calibrate a unit
===================

A coil of silicone tube under the insole, a gauge pressure sensor on it: the reading follows the load late and relaxes
under it. Here a unit is pressed by a testing machine, identified, and judged on loads that were not fitted. The machine
is simulated; ``log:FOLDER`` in the place of ``sim:instron`` is a real one's logs.
"""

from dataclasses import replace

import smartshoe

with smartshoe.open_machine("sim:instron", unit="left_toe", seed=1) as machine:
    staircase = machine.run(smartshoe.static_protocol((200.0, 400.0, 600.0, 800.0)))
    triangles = machine.run(smartshoe.dynamic_protocol((50.0, 200.0, 800.0), repeats=2))
    check = machine.run(replace(smartshoe.dynamic_protocol((100.0, 400.0)), name="check"))

triangles

# %%
# A recording holds named channels with units. The load falls back to zero; the reading needs a while.
triangles.plot()

# %%
# Identify
# --------
#
# One call takes offsets, a delay between the two loggers and the state at the start along with the model's three
# coefficients. Each number comes with its error bar.
found = smartshoe.identify([staircase, triangles])
print(found.summary())

# %%
# Residuals that look like noise say that the model has taken what there is to take. A simulated unit has more in it
# than a first-order model: the machine's own lag, quantisation, noise on both signals.
found.plot()

# %%
# Judge
# -----
#
# Only loads that were *not* fitted count. Three errors stand side by side: of the reading as it is, of the best static
# line through it (what a calibration without dynamics reaches), and of the compensated force.
calibration = found.calibration(unit="left_toe")
judged = smartshoe.validate([check], calibration)
print(judged.summary())

# %%
judged.plot()

# %%
# Use
# ---
#
# The calibration is one file. The compensator made from it takes whole signals, blocks or single readings, and gives
# the same numbers each way.
calibration.save("left_toe.json")
compensator = smartshoe.Calibration.load("left_toe.json").compensator(sample_rate_hz=100.0)
readings = check.sensor.values
whole_n = compensator.apply(readings)
streamed_n = [compensator.push(reading) for reading in readings[:1000]]
print(f"the same numbers: {abs(whole_n[:1000] - streamed_n).max() == 0.0}")
print(f"peak load {check.force_n.max():.1f} N, peak of the estimate {whole_n.max():.1f} N")
