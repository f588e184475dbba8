"""Keeps of a recogniser's JSON what one speaker says, where it tells who says what."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from elocute.errors import InputError
from elocute.speech.times.tier_choice import TierChoice, check_one_speaker

KEYS = frozenset(["speaker", "speakerid", "speakerlabel", "speakername", "speakertag"])
DEPTH_MAX = 16


def of_one_speaker(value: Any, choice: TierChoice) -> Any:
    """The same value without what others say than the chosen speaker.

    Raises InputError where several speak and none was chosen, and for one who says nothing.
    """
    names = list(dict.fromkeys(name for name in _speakers(value) if name))
    if not choice.speaker or not names:
        check_one_speaker(names)
        choice.check_unused()
        return value
    TierChoice(choice.tier).check_unused()
    wanted = choice.speaker.strip().lower()
    if wanted not in map(str.lower, names):
        raise InputError.about(
            f"`speaker` {choice.speaker[:40]!r}", found=", ".join(names[:5]), allowed="one of these"
        )
    return _said_by(value, wanted)


def _inner(value: Any, depth: int) -> Iterator[tuple[Any, Any]]:
    """The key or place of each part that holds records, and the part."""
    if depth < DEPTH_MAX:
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, part in pairs:
            if isinstance(part, dict) or (isinstance(part, list) and any(_inner(part, depth + 1))):
                yield key, part


def _name(value: Any, before: str) -> str:
    """Who says a value: the one it names, else the one that is named around it."""
    for key, name in value.items() if isinstance(value, dict) else ():
        if key.lower().replace("_", "") in KEYS and isinstance(name, str | int):
            return str(name).strip()
    return before


def _speakers(value: Any, before: str = "", depth: int = 0) -> Iterator[str]:
    """Who says each of the innermost records, "" where nobody is named."""
    name, within = _name(value, before), [*_inner(value, depth)]
    if not within:
        yield name
    for _, part in within:
        yield from _speakers(part, name, depth + 1)


def _said_by(value: Any, wanted: str, before: str = "", depth: int = 0) -> Any:
    """A value with those of its innermost records that `wanted` says; None where none is left."""
    name, within = _name(value, before), [*_inner(value, depth)]
    if not within:
        return value if name.lower() == wanted else None
    parts = {key: _said_by(part, wanted, name, depth + 1) for key, part in within}
    if all(part is None for part in parts.values()):
        return None
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    kept = {key: parts.get(key, part) for key, part in pairs}
    kept = {key: part for key, part in kept.items() if key not in parts or part is not None}
    return kept if isinstance(value, dict) else [*kept.values()]
