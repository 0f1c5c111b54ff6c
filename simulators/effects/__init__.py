"""Effects that a truth may have, one file a family: their parameters (a scenario's options) and their physics.

Every one is the identity at its default. What must be solved together with the wall's balance is stepped in
`simulators.plant._wall_stepping`; the rest acts on a signal at the fine step, or in the logger.
"""
