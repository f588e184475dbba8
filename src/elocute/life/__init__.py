"""Life behind a speaking face: head, brows, blinks, gaze, breath and moods, made from the sound."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.life.moods import MOODS as MOODS, Mood as Mood, resolve_mood as resolve_mood
    from elocute.life.settings import Life as Life, resolve_life as resolve_life
    from elocute.life.stream import LifeStream as LifeStream

__getattr__, __dir__ = lazy(__name__, __file__)
