"""
3. What does the model get wrong?
=================================

A unit with friction between its wall and the insole: the reading depends on whether the load rises or falls, at any
rate. No linear filter takes that out. ``diagnose`` says what is missing, how sure that is, and what a model that has it
gains on data that nothing was fitted to.
"""

from dataclasses import replace

import smartshoe

friction = {"strength": 0.02, "half_width_n": 40.0}
with smartshoe.open_machine("sim:instron", unit="left_heel", seed=3, bladder={"hysteresis": friction}) as machine:
    staircase = machine.run(smartshoe.static_protocol((200.0, 400.0, 600.0, 800.0)))
    triangles = machine.run(smartshoe.dynamic_protocol((50.0, 200.0, 800.0), repeats=2))
    check = machine.run(replace(smartshoe.dynamic_protocol((100.0, 400.0)), name="check"))

diagnosis = smartshoe.diagnose([staircase, triangles], hold_out=[check])
print(diagnosis.summary())

# %%
# What the extended model gains is told by the recording that nothing was fitted to.
diagnosis.plot()

# %%
# What to measure next
# --------------------
#
# Where two effects explain the data alike, both are named, with the experiment that would tell them apart.
for cause in diagnosis.causes:
    print(cause.effect.name, f"{cause.confidence:.2f}", "or", ", ".join(cause.equivalents) or "nothing else")
print(diagnosis.next_experiment.says if diagnosis.next_experiment else "nothing is in doubt")
