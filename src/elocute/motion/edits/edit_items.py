"""The items of an edit list, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

BLEND_S = 0.1


@dataclass(frozen=True)
class Moment:
    """A time: seconds from the start, or from the end (0 or less)."""

    seconds: float
    from_end: bool = False

    def at(self, duration_s: float) -> float:
        """Seconds from the start of a motion of this length."""
        return self.seconds + (duration_s if self.from_end else 0.0)


@dataclass(frozen=True)
class Span:
    """When an edit holds; None for an end of the motion. `blend_s`: how long it comes and goes."""

    start: Moment | None = None
    stop: Moment | None = None
    blend_s: tuple[float, float] = (BLEND_S, BLEND_S)


Keys = tuple[tuple[Moment, tuple[float, ...]], ...]


@dataclass(frozen=True)
class StyleItem:
    """Another speaking style for a while; made with the speech."""

    style: str
    span: Span


@dataclass(frozen=True)
class MoodItem:
    """Another mood for a while; made with the speech."""

    mood: str
    span: Span


@dataclass(frozen=True)
class OffsetItem:
    """The mouth before (negative) or after its sound, s."""

    seconds: float


@dataclass(frozen=True)
class AmplitudeItem:
    """How far regions move."""

    regions: Mapping[str, float]
    span: Span


@dataclass(frozen=True)
class CurveItem:
    """Keys of one curve."""

    curve: str
    keys: Keys
    mode: str
    between: str
    contacts: str
    span: Span


@dataclass(frozen=True)
class ClosedItem:
    """Lips held sealed; `span.blend_s` lies around."""

    span: Span


@dataclass(frozen=True)
class HeadItem:
    """Turns of the head, degrees."""

    keys: Keys
    mode: str
    between: str
    span: Span


@dataclass(frozen=True)
class GazeItem:
    """Where the eyes look, degrees."""

    keys: Keys
    between: str
    span: Span


@dataclass(frozen=True)
class BlinksItem:
    """Blinks taken out (None: all), then put in."""

    remove: tuple[Moment, ...] | None
    add: tuple[Moment, ...]
    per_minute: float
    seed: int


@dataclass(frozen=True)
class FaceItem:
    """Identities over time: names or seeds."""

    keys: tuple[tuple[Moment, str], ...]


@dataclass(frozen=True)
class RetimeItem:
    """Old and new times."""

    times: tuple[tuple[Moment, float], ...]


@dataclass(frozen=True)
class LoopItem:
    """An end that meets the beginning."""

    blend_s: float


Item = (
    StyleItem
    | MoodItem
    | OffsetItem
    | AmplitudeItem
    | CurveItem
    | ClosedItem
    | HeadItem
    | GazeItem
    | BlinksItem
    | FaceItem
    | RetimeItem
    | LoopItem
)
