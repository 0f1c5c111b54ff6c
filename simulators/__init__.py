"""Truths for smartshoe: bladders, instruments, machines and shoes simulated from physics.

They are richer than any model that smartshoe fits, and share no equation's code with it.
"""
