"""How much a compressed file may unpack to, so that a small file cannot fill the memory."""

from __future__ import annotations

UNPACKED_TIMES = 100
"""A file may unpack to this many times its own size …"""
UNPACKED_FREE_BYTES = 64_000_000
"""… or to this much, whichever is more."""


def unpacked_limit(packed_bytes: int, free_bytes: int = UNPACKED_FREE_BYTES) -> int:
    """Bytes that a file may unpack to.

    Parameters
    ----------
    packed_bytes : int
        Size of the file, bytes.
    free_bytes : int
        What any file may unpack to, however small it is, bytes.

    Returns
    -------
    int
        The larger of `free_bytes` and `UNPACKED_TIMES` times the size of the file.
    """
    return max(free_bytes, UNPACKED_TIMES * packed_bytes)
