"""What noise, styles and faces do to a model's mouth (VOCA 2019, section 7.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

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

Doubles = NDArray[np.float64]
Opening = Callable[[Waveform], Doubles]
"""Sound to the opening of the mouth, (frame,) mm."""


@dataclass(frozen=True)
class NoiseScore:
    """One level of noise, or of gain.

    amplitude_mm     mean opening of the mouth
    amplitude_share  the same relative to the clean result: below 1 the motion is damped
    correlation      of the opening with the clean result, 0 for a mouth that does not move
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
) -> tuple[list[NoiseScore], list[Doubles]]:
    """A score per level, and the openings: the clean one, then one per level.

    noise (sample,) at the speech's rate; None takes the levels as gains of the speech itself.
    Raises AudioError for noise that is silent.
    """
    clean = opening(speech)
    heard = [
        with_gain(speech, level) if noise is None else with_noise(speech, noise, level)
        for level in levels_db
    ]
    openings = [opening(sound) for sound in heard]
    scores = [
        NoiseScore(level, float(o.mean()), _share(o, clean), pearson(o, clean))
        for level, o in zip(levels_db, openings, strict=True)
    ]
    return scores, [clean, *openings]


def mean_noise_scores(clips: Sequence[Sequence[NoiseScore]]) -> list[NoiseScore]:
    """Level by level, the means over clips."""
    return [
        NoiseScore(*(float(mean) for mean in np.mean([list(vars(s).values()) for s in level], 0)))
        for level in zip(*clips, strict=True)
    ]


def _share(opening: Doubles, clean: Doubles) -> float:
    return float(opening.mean() / clean.mean()) if clean.mean() > 1e-9 else 1.0


def style_openings(styles: Sequence[str], animate: Callable[[str], Motion]) -> Curves:
    """One curve of mouth opening (mm) per style: the paper's figure 6.

    The decoder is linear, so mixing results convexly reaches everything between the least and
    the greatest of them. Raises HeadError for a head without lips.
    """
    motions = [animate(style) for style in styles]
    columns = [measure_mouth(motion)["opening_mm"] for motion in motions]
    return Curves(np.stack(columns, axis=1), tuple(styles), motions[0].fps)


@dataclass(frozen=True)
class FaceScore:
    """One face saying the speech, mm.

    mean_opening, peak_opening  over the whole speech
    contact_gap                 the widest opening in frames where the lips touch on the motion's
                                own face: 0 where those of this face meet as often
    width_range                 by how much the distance of the mouth corners changes
    """

    mean_opening_mm: float
    peak_opening_mm: float
    contact_gap_mm: float
    width_range_mm: float


def face_scores(motion: Motion, count: int, seed: int) -> list[FaceScore]:
    """The same motion on `count` random faces of the built-in head.

    Its lips rest alike on every face and shapes add up, so scores that differ tell of a fault.
    Raises InputError for a motion of another topology or a count that is none.
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
    """A face with the shapes of the motion, where they are not the built-in ones."""
    if motion.names == face.expression_names:
        return face
    basis = motion.head.expression_basis
    return replace(face, expression_names=motion.names, expression_basis=basis)


def _face_score(motion: Motion, touching: NDArray[np.bool_]) -> FaceScore:
    measures = measure_mouth(motion)
    opening, width = measures["opening_mm"], measures["width_mm"]
    gap = float(opening[touching].max()) if touching.any() else 0.0
    return FaceScore(float(opening.mean()), float(opening.max()), gap, float(np.ptp(width)))


def _opening(motion: Motion) -> Doubles:
    return measure_mouth(motion)["opening_mm"].astype(np.float64)


def face_score_spread(scores: Sequence[FaceScore]) -> dict[str, dict[str, float]]:
    """Per measure the mean, standard deviation, least and greatest over faces."""
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
