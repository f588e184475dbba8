"""What noise and styles do to the mouth that a model animates (VOCA 2019, section 7.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.evaluation.lip_closures import count_closures
from elocute.motion.curves import Curves
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.correlation import pearson

Opening = Callable[[Waveform], Float64Array]
"""Sound to the opening of the mouth, (frame,) mm."""


Disturbance = Callable[[Waveform], Waveform]
"""Clean speech to the same speech disturbed."""


@dataclass(frozen=True)
class NoiseScore:
    """The mouth that disturbed speech moves, beside the one that clean speech moves.

    Attributes
    ----------
    amplitude_mm : float
        Mean opening of the mouth, mm.
    amplitude_share : float
        The same relative to clean speech; below 1 the motion is damped.
    correlation : float
        Of the opening with that of clean speech; 0 for a mouth that does not move.
    closures_wanted, closures_met : float
        Closures of clean speech, and those that are still made.
    closures_made, closures_right : float
        Closures of disturbed speech, and those that clean speech makes too.
    """

    amplitude_mm: float
    amplitude_share: float
    correlation: float
    closures_wanted: float
    closures_met: float
    closures_made: float
    closures_right: float

    @property
    def closure_recall(self) -> float:
        """Share of the closures of clean speech that are still made; NaN without any."""
        return self.closures_met / self.closures_wanted if self.closures_wanted else np.nan

    @property
    def closure_precision(self) -> float:
        """Share of the closures made that clean speech makes too; NaN without any."""
        return self.closures_right / self.closures_made if self.closures_made else np.nan


def noise_scores(
    speech: Waveform, disturbances: Sequence[Disturbance], opening: Opening, fps: float
) -> tuple[list[NoiseScore], list[Float64Array]]:
    """Score the mouth under disturbed speech.

    Parameters
    ----------
    speech : Waveform
        Clean speech.
    disturbances : sequence of callable
        Each takes the speech and gives it disturbed, such as `with_noise` at a level.
    opening : callable
        Takes a Waveform and gives the opening of the mouth, (frame,) mm.
    fps : float
        Frames per second of the openings.

    Returns
    -------
    scores : list of NoiseScore
        One for each disturbance.
    openings : list of (frame,) float64
        For clean speech, then for each disturbance, mm.

    Raises
    ------
    AudioError
        For what a disturbance cannot be made of, such as silent noise.
    """
    clean = opening(speech)
    openings = [opening(disturb(speech)) for disturb in disturbances]
    scores = [_noise_score(disturbed, clean, fps) for disturbed in openings]
    return scores, [clean, *openings]


def _noise_score(opening: Float64Array, clean: Float64Array, fps: float) -> NoiseScore:
    counts = count_closures(opening, clean, fps)
    return NoiseScore(
        amplitude_mm=float(opening.mean()),
        amplitude_share=_share(opening, clean),
        correlation=pearson(opening, clean),
        closures_wanted=counts.wanted,
        closures_met=counts.met,
        closures_made=counts.made,
        closures_right=counts.right,
    )


def mean_noise_scores(clips: Sequence[Sequence[NoiseScore]]) -> list[NoiseScore]:
    """Means over clips under the same disturbances, disturbance by disturbance."""
    names = [field.name for field in fields(NoiseScore)]
    return [
        NoiseScore(**{n: float(np.mean([getattr(score, n) for score in alike])) for n in names})
        for alike in zip(*clips, strict=True)
    ]


def _share(opening: Float64Array, clean: Float64Array) -> float:
    """Mean opening relative to the clean one; 1 where that is closed throughout."""
    return float(opening.mean() / clean.mean()) if clean.mean() > 1e-9 else 1.0


def sample_mixes(styles: Sequence[str], count: int) -> tuple[str, ...]:
    """So many random mixes of styles as `style` takes them, always the same."""
    shares = np.random.default_rng(0).dirichlet(np.full(len(styles), 0.3), count)
    return tuple(
        ",".join(f"{name}:{share:.4f}" for name, share in zip(styles, row, strict=True))
        for row in shares
    )


def style_openings(styles: Sequence[str], animate: Callable[[str], Motion]) -> Curves:
    """The opening of the mouth in each style (VOCA 2019, figure 6).

    Mixes of the styles' outputs reach everything between the least and the greatest of the curves.

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
