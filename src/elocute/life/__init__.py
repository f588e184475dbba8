"""Life behind a speaking face: head, brows, blinks, gaze, breath and moods, made from the sound."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.life.moods import MOODS, Mood, resolve_mood
    from elocute.life.settings import Life, resolve_life
    from elocute.life.stream import LifeStream

__all__ = [
    "MOODS",
    "Life",
    "LifeStream",
    "Mood",
    "resolve_life",
    "resolve_mood",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "moods": ("MOODS", "Mood", "resolve_mood"),
        "settings": ("Life", "resolve_life"),
        "stream": ("LifeStream",),
    },
)
