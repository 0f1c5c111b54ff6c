"""Compiled passes over the data, without decisions: the calling packages choose what is fitted or filtered."""
