"""The sound of each frame, for receivers that play both together."""

from __future__ import annotations


class SoundOfFrames:
    """Mono samples of 16 bits, given out frame by frame.

    Each frame has the sound from its own time to that of the next one; the last has the rest.
    """

    def __init__(self, rate: int, fps: float) -> None:
        self._rate, self._fps = rate, fps
        self._kept = bytearray()
        self._given = self._frames = 0

    @property
    def taken(self) -> int:
        """How many samples came so far."""
        return self._given + len(self._kept) // 2

    def add(self, pcm: bytes) -> None:
        """Take sound that ends anywhere, within a sample too."""
        self._kept += pcm

    def next_frame(self, *, is_last: bool = False) -> tuple[float, bytes]:
        """When the sound of the next frame begins, s, and that sound."""
        began, self._frames = self._given, self._frames + 1
        until = self.taken if is_last else round(self._frames / self._fps * self._rate)
        count = min(max(0, until - began), len(self._kept) // 2)
        sound = bytes(self._kept[: 2 * count])
        del self._kept[: 2 * count]
        self._given += count
        return began / self._rate, sound
