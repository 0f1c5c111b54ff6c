"""
4. A walk
=========

Half a minute of walking in two shoes, and what a gait laboratory asks of it. The person is simulated; a recording of
your own is read by ``smartshoe.read`` as before, and forces come from the calibrations of the units.
"""

import matplotlib.pyplot as plt
import numpy as np

from simulators.people import Person, Walk, trial
from smartshoe.gait import Coverage, analyse

made = trial(Person(), Walk(1.3), 30.0, np.random.default_rng(1), sensors=False, noise_n=1.0)
made.recording

# %%
# Events, strides, forces
# -----------------------
#
# Insoles bear a part of the load; ``Coverage`` says which. Without it forces are marked as resting on a guess.
found = analyse(made.recording, coverage=Coverage.midfoot(0.8))
found

# %%
found.plot()

# %%
# Every curve is there as an array, every stride as a row of a data frame.
print(found.to_frame().head())

left = found.feet["left"]
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.plot(left.time_s, left.force_n)
_ = axes.set(xlabel="time (s)", ylabel="force on the left foot (N)", xlim=(10.0, 15.0))
