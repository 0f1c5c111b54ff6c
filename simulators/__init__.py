"""Physical simulations of bladders, instruments, machines and shoes, whose truth is known to tests of smartshoe.

They are richer than any model that smartshoe fits, and share no code for equations with it.
"""
