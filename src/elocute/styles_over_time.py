"""Styles and moods over time: a take in each that occurs, mixed frame by frame.

Frames of a mix lie between frames of the same sound, so contacts that all of them
make are made.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError, MotionError
from elocute.life.moods import Mood, resolve_mood
from elocute.models.protocol import SpeechModel
from elocute.models.style_mixes import checked_style
from elocute.motion.curves import Curves
from elocute.motion.edits.applying import share_of
from elocute.motion.edits.edit_items import MoodItem, Span, StyleItem
from elocute.motion.edits.edit_list import EditList
from elocute.numerics.quaternions import no_turn

PAIRS_MAX = 64
"""Of styles times moods in one take; each is computed for the whole of it."""


@dataclass(frozen=True, eq=False)
class StyleAndMood:
    """A style, as the model has resolved it, and a mood."""

    style: Any
    mood: Mood


@dataclass(frozen=True, eq=False)
class _Layer:
    """Something else for a while, the edit's place in its list, and when it holds."""

    value: Any
    name: Hashable
    place: int
    span: Span


class StylesOverTime:
    """The styles and moods of a take, checked before anything is computed.

    Parameters
    ----------
    model : SpeechModel
        What resolves styles.
    style
        The style of the take, resolved.
    mood : Mood
        Its mood.
    outputs : bool
        As `SpeechModel.style` takes it.
    edits : EditList, optional
        What has style and mood items, perhaps.

    Raises
    ------
    MotionError
        For a style or mood that is not known, naming the edit, and for too many of them.
    """

    def __init__(
        self, model: SpeechModel, style: Any, mood: Mood, outputs: bool, edits: EditList | None
    ) -> None:
        self._base, self._source = StyleAndMood(style, mood), edits.source if edits else ""
        self._styles: list[_Layer] = []
        self._moods: list[_Layer] = []
        for place, item in enumerate(edits.items if edits else ()):
            try:
                if isinstance(item, StyleItem):
                    value = model.style(_named(item.style), outputs=outputs)
                    self._styles.append(_Layer(value, item.style, place, item.span))
                elif isinstance(item, MoodItem):
                    value = resolve_mood(item.mood)
                    self._moods.append(_Layer(value, item.mood, place, item.span))
            except InputError as error:
                raise MotionError(f"{self._source}: edits[{place}]: {error}") from None
        names = [len({layer.name for layer in part}) + 1 for part in (self._styles, self._moods)]
        if names[0] * names[1] > PAIRS_MAX:
            raise MotionError.about(
                self._source,
                found=f"{names[0]} styles and {names[1]} moods in one take",
                allowed=f"up to {PAIRS_MAX} pairs of them",
                remedy="cut the take",
            )

    def shares(self, count: int, fps: float) -> list[tuple[StyleAndMood, NDArray[np.float64]]]:
        """How much of each style and mood is in each frame.

        Parameters
        ----------
        count : int
            Number of frames.
        fps : float
            Frames per second.

        Returns
        -------
        list of (StyleAndMood, (frame,))
            Shares that sum to one; none that is zero throughout.

        Raises
        ------
        MotionError
            For times outside the take.
        """
        times_s = np.arange(count) / fps
        styles = self._layered(self._styles, self._base.style, times_s, count / fps)
        moods = self._layered(self._moods, self._base.mood, times_s, count / fps)
        pairs = [
            (StyleAndMood(style, mood), of_style * of_mood)
            for style, of_style in styles
            for mood, of_mood in moods
        ]
        return [(each, share) for each, share in pairs if share.any()]

    def _layered(
        self, layers: Sequence[_Layer], base: Any, times_s: NDArray[np.float64], duration_s: float
    ) -> list[tuple[Any, NDArray[np.float64]]]:
        """Each value and its (frame,) share; a later layer covers those before it."""
        values: dict[Hashable, Any] = {None: base}
        shares: dict[Hashable, NDArray[np.float64]] = {None: np.ones(len(times_s))}
        for layer in layers:
            try:
                over = share_of(layer.span, times_s, duration_s)
            except InputError as error:
                raise MotionError(f"{self._source}: edits[{layer.place}]: {error}") from None
            shares = {name: share * (1 - over) for name, share in shares.items()}
            shares[layer.name] = shares.get(layer.name, 0) + over
            values[layer.name] = layer.value
        return [(values[name], share) for name, share in shares.items()]


def _named(style: str) -> str:
    """A style by its name or mix. Raises InputError for a file: a list stands for itself."""
    if style.lower().endswith(".json") or "/" in style or "\\" in style:
        raise InputError.about("style", found=repr(style[:60]), allowed="a name or a mix, no file")
    checked_style(style)
    return style


def mixed_takes(
    shares: Sequence[tuple[StyleAndMood, NDArray[np.float64]]],
    made: Callable[[StyleAndMood], tuple[Curves, NDArray[np.float32] | None]],
) -> tuple[Curves, NDArray[np.float32] | None]:
    """One take of those in each style and mood.

    Parameters
    ----------
    shares : list of (StyleAndMood, (frame,))
        From `StylesOverTime.shares`.
    made : callable
        The curves in a style and mood, and rotations (frame, joint, 4), or None.

    Returns
    -------
    Curves, (frame, joint, 4) or None
        Those of a single one as they are, or the means of several.
    """
    takes = [(*made(each), share) for each, share in shares]
    if len(takes) == 1:
        return takes[0][:2]
    names = tuple(dict.fromkeys(name for curves, _, _ in takes for name in curves.names))
    values = sum(share[:, None] * curves.select(names).values for curves, _, share in takes)
    curves = Curves(np.asarray(values, np.float32), names, takes[0][0].fps)
    turned = [turns for _, turns, _ in takes if turns is not None]
    if not turned:
        return curves, None
    still = no_turn(*turned[0].shape[:2])
    mean = sum(
        share[:, None, None] * (still if turns is None else turns) for _, turns, share in takes
    )
    mean = np.asarray(mean) / np.linalg.norm(np.asarray(mean), axis=-1, keepdims=True)
    return curves, mean.astype(np.float32)
