"""Effects of a simulated unit, one file per family: their parameters (a scenario's options) and their physics.

Every effect is off at its default. Effects that must be solved together with the wall's balance are stepped in
`simulators.plant._wall_stepping`; the others act on a signal at the fine step, or in the logger.
"""
