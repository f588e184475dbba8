"""What noise, styles and faces do to the mouth that a model animates (VOCA 2019, section 7.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.audio.noise import with_gain, with_noise
from elocute.audio.waveform import Waveform
from elocute.errors import InputError
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identities
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.correlation import pearson

Opening = Callable[[Waveform], Float64Array]
"""Sound to the opening of the mouth, (frame,) mm."""


@dataclass(frozen=True)
class NoiseScore:
    """The mouth at one level of noise, or of gain.

    Attributes
    ----------
    level_db : float
        Of the noise against the speech, or of the gain, dB.
    amplitude_mm : float
        Mean opening of the mouth, mm.
    amplitude_share : float
        The same relative to clean speech; below 1 the motion is damped.
    correlation : float
        Of the opening with that of clean speech; 0 for a mouth that does not move.
    """

    level_db: float
    amplitude_mm: float
    amplitude_share: float
    correlation: float


def noise_scores(
    speech: Waveform,
    noise: NDArray[np.float32] | None,
    levels_db: Sequence[float],
    opening: Opening,
) -> tuple[list[NoiseScore], list[Float64Array]]:
    """Score the mouth at several levels of noise.

    Parameters
    ----------
    speech : Waveform
        Clean speech.
    noise : (sample,) float32 or None
        At the speech's rate; None takes the levels as gains of the speech itself.
    levels_db : sequence of float
        Levels against the speech, dB.
    opening : callable
        Takes a Waveform and gives the opening of the mouth, (frame,) mm.

    Returns
    -------
    scores : list of NoiseScore
        One for each level.
    openings : list of (frame,) float64
        For clean speech, then for each level, mm.

    Raises
    ------
    AudioError
        For silent noise.
    """
    clean = opening(speech)
    sounds = [
        with_gain(speech, level) if noise is None else with_noise(speech, noise, level)
        for level in levels_db
    ]
    openings = [opening(sound) for sound in sounds]
    scores = [
        NoiseScore(level, float(o.mean()), _share(o, clean), pearson(o, clean))
        for level, o in zip(levels_db, openings, strict=True)
    ]
    return scores, [clean, *openings]


def mean_noise_scores(clips: Sequence[Sequence[NoiseScore]]) -> list[NoiseScore]:
    """Means over clips, level by level.

    Parameters
    ----------
    clips : sequence of sequences of NoiseScore
        Scores of each clip at the same levels.

    Returns
    -------
    list of NoiseScore
        One for each level.
    """
    return [
        NoiseScore(*(float(mean) for mean in np.mean([list(vars(s).values()) for s in level], 0)))
        for level in zip(*clips, strict=True)
    ]


def _share(opening: Float64Array, clean: Float64Array) -> float:
    """Mean opening relative to the clean one; 1 where that is closed throughout."""
    return float(opening.mean() / clean.mean()) if clean.mean() > 1e-9 else 1.0


def style_openings(styles: Sequence[str], animate: Callable[[str], Motion]) -> Curves:
    """The opening of the mouth in each style (VOCA 2019, figure 6).

    A decoder is linear, so convex mixtures of styles reach everything between the least and the
    greatest of the curves.

    Parameters
    ----------
    styles : sequence of str
        Names of styles.
    animate : callable
        Gives the Motion of the same speech in a style.

    Returns
    -------
    Curves
        One curve for each style, mm.

    Raises
    ------
    HeadError
        For a head without lips.
    """
    motions = [animate(style) for style in styles]
    columns = [measure_mouth(motion)["opening_mm"] for motion in motions]
    return Curves(np.stack(columns, axis=1), tuple(styles), motions[0].fps)


@dataclass(frozen=True)
class FaceScore:
    """The mouth of one face that says the speech.

    Attributes
    ----------
    mean_opening_mm, peak_opening_mm : float
        Over the whole speech, mm.
    contact_gap_mm : float
        The widest opening in frames where the lips touch on the motion's own face, mm: 0 where
        those of this face touch too.
    width_range_mm : float
        Range of the distance between the mouth corners, mm.
    """

    mean_opening_mm: float
    peak_opening_mm: float
    contact_gap_mm: float
    width_range_mm: float


def face_scores(motion: Motion, count: int, seed: int) -> list[FaceScore]:
    """Score the same motion on random faces of the built-in head.

    Its lips rest alike on every face and shapes add up, so scores that differ show a fault.

    Parameters
    ----------
    motion : Motion
        In the topology of the built-in head.
    count : int
        Number of faces.
    seed : int
        The same seed gives the same faces.

    Returns
    -------
    list of FaceScore
        One for each face.

    Raises
    ------
    InputError
        For a motion of another topology, or an unusable count.
    """
    head = load_builtin_head()
    if motion.head.vertex_count != head.vertex_count:
        raise InputError.about(
            f"head {motion.head.name!r}",
            found="no identity space",
            allowed="a model that moves the built-in topology",
        )
    touching = _opening(motion) < CLOSED_MM
    return [
        _face_score(replace(motion, head=_face(motion, head.with_identity(coefficients))), touching)
        for coefficients in sample_identities(head, count, seed)
    ]


def _face(motion: Motion, face: HeadModel) -> HeadModel:
    """A face with the motion's own shapes, where these are not the built-in ones."""
    if motion.names == face.expression_names:
        return face
    basis = motion.head.expression_basis
    return replace(face, expression_names=motion.names, expression_basis=basis)


def _face_score(motion: Motion, touching: NDArray[np.bool_]) -> FaceScore:
    """Score of a motion; `touching` (frame,) is where the lips touch on its own face."""
    measures = measure_mouth(motion)
    opening, width = measures["opening_mm"], measures["width_mm"]
    gap = float(opening[touching].max()) if touching.any() else 0.0
    return FaceScore(float(opening.mean()), float(opening.max()), gap, float(np.ptp(width)))


def _opening(motion: Motion) -> Float64Array:
    """(frame,) mm between the lips."""
    return measure_mouth(motion)["opening_mm"].astype(np.float64)


def face_score_spread(scores: Sequence[FaceScore]) -> dict[str, dict[str, float]]:
    """Mean, standard deviation, least and greatest of each measure over faces.

    Parameters
    ----------
    scores : sequence of FaceScore
        One or more.

    Returns
    -------
    dict of str to dict
        For each measure `mean`, `deviation`, `least` and `greatest`, mm.
    """
    table = {}
    for name in asdict(scores[0]):
        values = np.array([getattr(score, name) for score in scores])
        table[name] = {
            "mean": float(values.mean()),
            "deviation": float(values.std()),
            "least": float(values.min()),
            "greatest": float(values.max()),
        }
    return table
