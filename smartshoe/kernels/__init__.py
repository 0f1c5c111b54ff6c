"""Compiled passes over the data, and nothing else: what is fitted or filtered is decided above."""
