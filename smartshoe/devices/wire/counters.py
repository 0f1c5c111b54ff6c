"""Counts of what a decoder has met so far."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(slots=True)
class Counters:
    """Counts of frames by outcome; every frame (or line) is in exactly one of the first eight.

    ``frames`` are the samples that were given out, ``information`` the information frames (comment and header lines).
    ``bad_crc`` failed their checksum, ``malformed`` had an impossible form, ``unknown_type`` are intact but of an
    unknown type. ``duplicated`` had arrived before, ``late`` arrived after a later sample was given out, and
    ``implausible`` contradicted the frames before and behind: none of these three is given out.

    ``lost`` are the samples that the device took and that were never given out (a late one remains lost);
    ``resynchronisations`` counts how often a good frame was found after bad bytes; ``restarts`` are those of the
    device; ``bytes`` is the number of bytes fed.
    """

    frames: int = 0
    information: int = 0
    bad_crc: int = 0
    malformed: int = 0
    unknown_type: int = 0
    duplicated: int = 0
    late: int = 0
    implausible: int = 0
    lost: int = 0
    resynchronisations: int = 0
    restarts: int = 0
    bytes: int = 0

    @property
    def bad(self) -> int:
        """The number of frames or lines that could not be used because of checksum, form or type."""
        return self.bad_crc + self.malformed + self.unknown_type

    def as_dict(self) -> dict[str, int]:
        """The counts by name, for JSON."""
        return asdict(self)
