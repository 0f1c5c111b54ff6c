"""Compiled inner loops (numba), each beside a plain twin that the tests compare it with."""
