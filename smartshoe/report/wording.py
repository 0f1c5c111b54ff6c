"""Turns texts into sentences and identifiers into words for a person."""

from __future__ import annotations


def sentence(text: str) -> str:
    """``text`` with a full stop and a capital letter, unless it begins with a name of a file or a recording."""
    text = text.strip()
    if not text:
        return ""
    begun = text[:1].upper() + text[1:] if text.split(maxsplit=1)[0].rstrip(",:").isalpha() else text
    return begun if begun.endswith((".", "!", "?")) else f"{begun}."


def words(identifier: str) -> str:
    """An identifier as words: ``linear_leak`` as "linear leak"."""
    return identifier.replace("_", " ")
