"""A shoe's firmware behind a pseudo-terminal, with the faults of a transmission line."""
