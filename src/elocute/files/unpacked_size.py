"""How much a compressed file may unpack to, so that a small file cannot fill the memory."""

from __future__ import annotations

UNPACKED_TIMES = 100
"""A file may unpack to this many times its own size …"""
UNPACKED_FREE_BYTES = 64_000_000
"""… or to this much, whichever is more."""


def unpacked_limit(packed_bytes: int, free_bytes: int = UNPACKED_FREE_BYTES) -> int:
    """Bytes that a file may unpack to: `UNPACKED_TIMES` its size, and `free_bytes` at least."""
    return max(free_bytes, UNPACKED_TIMES * packed_bytes)
