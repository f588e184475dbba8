"""Raters who look: a model of what people may see in a study, before people are asked.

They measure each clip's motion as it is shown (`seen_mouths`), weigh what they see to a strength in
logits (`Weights`), and answer as a crowd does, with lapses, sides and differences between people
(`crowd`). One weight, that of timing, follows from what delays people notice; the others are set by
hand. They know nothing of who speaks, how a face looks, or what makes a recording of somebody
better than a good prediction: a model, and no people.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.errors import HeadError, StudyError
from elocute.settings import check_settings, described, setting
from elocute.study.design.design import MISMATCHED, Design
from elocute.study.design.trials import Clip, Trial, all_videos
from elocute.study.raters.crowd import Crowd, Truth
from elocute.study.raters.seen_faces import SeenFace, see
from elocute.study.raters.seen_mouths import (
    HeardSound,
    PeopleSeen,
    Seen,
    hear,
    look,
    people_seen,
    unusual,
)
from elocute.study.stimuli.clip_making import ClipMaking, pad_s
from elocute.study.stimuli.manifest import known_design
from elocute.study.stimuli.stimulus_pictures import shown_motion

NOTICED_MS = (-45.0, 125.0)
"""Where half notice that a sound is early or late (ITU-R BT.1359-1)."""
USUAL_POINTS = 75.0
"""Of a rating: a face with nothing to blame, "good" of five words."""
CALM, LIVELY = ("head", "lids"), ("jerk", "false seals")


@described
@dataclass(frozen=True)
class Weights:
    """What raters make of what they see, in logits.

    Raises
    ------
    StudyError
        For a value of another type or outside its range.
    """

    timing: float = setting(
        1.0, low=0, high=10, help="Of bad timing, as multiple of what people notice of delays."
    )
    missed_seals: float = setting(
        2.0, low=0, high=20, help="Of lips that stay open at every p, b and m."
    )
    missed_teeth: float = setting(
        1.0, low=0, high=20, help="Of a lower lip that stays away from the teeth at every f and v."
    )
    unusual: float = setting(
        0.5, low=0, high=20, help="Of each spread by which an amount is beyond what is usual."
    )
    unusual_most: float = setting(3.0, low=0, high=20, help="Spreads that count at most.")
    manner: float = setting(
        4.0, low=0, high=100, unit="1/mm", help="Of landmarks that are nearer a reference's."
    )

    def __post_init__(self) -> None:
        check_settings(self, StudyError)


@dataclass(frozen=True, eq=False)
class Sight:
    """What raters see of one clip.

    Attributes
    ----------
    seen : Seen
        Its measures.
    strength : float
        What they make of it, logits: 0 with nothing to blame, less with more.
    face : SeenFace
        What was measured.
    """

    seen: Seen
    strength: float
    face: SeenFace


def timing_loss(seen: Seen, people: PeopleSeen) -> float:
    """How much better a mouth would fit a sound that is moved, or than most of people's mouths do.

    People's own mouths differ in how well they fit; a mouth that fits as well as theirs and best
    where it is loses nothing, so that a smooth prediction is not liked for being average.

    Parameters
    ----------
    seen : Seen
        Of a clip.
    people : PeopleSeen
        How well people fit.

    Returns
    -------
    float
        0 or more, as correlation; 0 for a clip without sound.
    """
    if not np.isfinite(seen.fit):
        return 0.0
    return max(seen.best_fit, people.fit_least) - seen.fit


def blames(seen: Seen, weights: Weights, people: PeopleSeen) -> dict[str, float]:
    """What raters blame a clip for.

    Parameters
    ----------
    seen : Seen
        Its measures.
    weights : Weights
        Of what they see.
    people : PeopleSeen
        What is usual.

    Returns
    -------
    dict of str to float
        Logits, 0 or more, by reason; what could not be measured is not blamed.
    """
    far = unusual(seen, people)
    beyond = {
        # Too calm a head is blamed, and too busy a mouth: trackers' noise makes people rougher
        # and livelier than they are.
        name: -value if name in CALM else value if name in LIVELY else abs(value)
        for name, value in far.items()
    }
    told = {
        "timing": weights.timing * people.sync_weight * timing_loss(seen, people),
        "missed seals": weights.missed_seals * seen.missed_seals,
        "missed teeth": weights.missed_teeth * seen.missed_teeth,
    }
    for name, value in beyond.items():
        told[name] = weights.unusual * float(np.clip(value - 1, 0, weights.unusual_most))
    return {name: value for name, value in told.items() if np.isfinite(value)}


def strength(seen: Seen, weights: Weights | None = None, people: PeopleSeen | None = None) -> float:
    """What raters make of a clip.

    Parameters
    ----------
    seen : Seen
        Its measures.
    weights : Weights, optional
        Of what they see.
    people : PeopleSeen, optional
        What is usual; by default the package's own.

    Returns
    -------
    float
        Logits: 0 with nothing to blame, less with more.
    """
    return -sum(blames(seen, weights or Weights(), people or people_seen()).values())


def watch_study(
    path: str | Path,
    *,
    data: str | Path | None = None,
    levels: Mapping[str, float] | None = None,
    weights: Weights | None = None,
    progress: Callable[[float], None] | None = None,
) -> Raters:
    """Let raters look at every clip of a study that somebody may see.

    Parameters
    ----------
    path : str or Path
        study.toml, or a study's folder.
    data : str or Path, optional
        Where the names in the file begin; by default its own folder.
    levels : mapping of str to float, optional
        Strengths of conditions that are not looked at, as of others' videos: logits below (or
        above) a face with nothing to blame, or points of a rating.
    weights : Weights, optional
        Of what they see.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Raters

    Raises
    ------
    StudyError
        For a condition of videos, a head without lips, and a study of words, where they have no
        level; for files that are missing.
    """
    folder = Path(path) if Path(path).is_dir() else Path(path).parent
    begins = folder if data is None else Path(data)
    design, _ = known_design(path, begins)
    stated = dict(levels or {})
    _check(design, stated)
    watching = _Watching(design, begins, weights or Weights())
    clips = {
        (each.condition, _unseen_view(each.stimulus)): each
        for each in all_videos(design)[0]
        if _condition_of(design, each.condition) not in stated
    }
    sights = {}
    for done, (key, clip) in enumerate(clips.items(), 1):
        sights[key] = watching.sight(clip)
        if progress:
            progress(done / len(clips))
    return Raters(design, sights, stated, watching.weights)


def _check(design: Design, stated: Mapping[str, float]) -> None:
    asked = [each for each in design.judged if each.name not in stated]
    if design.study.kind == "intelligibility" and asked:
        raise StudyError.about(
            "`kind`",
            found="intelligibility: raters see mouths, and read no words",
            allowed="binary, style, rating, sync",
            remedy=f"give {asked[0].name} and every other condition a level",
        )
    for each in design.conditions:
        if each.videos and each.name not in stated:
            raise StudyError.about(
                f"condition {each.name}",
                found="videos, in which raters cannot measure motion",
                allowed="a model or motion",
                remedy="give it a level",
            )


def _condition_of(design: Design, name: str) -> str:
    return design.obvious if name == MISMATCHED else name


def _unseen_view(stimulus: str) -> str:
    """SOUND.IDENTITY: raters see a face alike from everywhere."""
    return stimulus.rpartition(".")[0]


class _Watching:
    """Sights of one study; sounds are heard once."""

    def __init__(self, design: Design, data: Path, weights: Weights) -> None:
        self.design, self.data, self.weights = design, data, weights
        self._heard: dict[tuple[Path, float, float], HeardSound] = {}
        self._sights: dict[object, Sight] = {}

    def sight(self, clip: Clip) -> Sight:
        """What raters see of a clip. Raises StudyError, and the errors of what reads files."""
        made = ClipMaking(self.design, self.data, clip)
        of_motion = replace(made.condition, name="shown", reference_for="")
        if self.design.study.kind == "sync":
            # What is asked for is the delay itself: faces are looked at in time.
            of_motion = replace(of_motion, offset_ms=0.0)
            made.condition = of_motion
        key = of_motion, made.sound, made.face, made.mismatched
        if key not in self._sights:
            self._sights[key] = self._look(made)
        return self._sights[key]

    def _look(self, made: ClipMaking) -> Sight:
        voice = made.voice()
        times = made.times(voice.duration_s + 2 * pad_s(self.design))
        source = replace(made.source, voice=made.moving_voice(voice))
        motion = shown_motion(source, times, around=made.mismatched)
        try:
            face = see(motion, -pad_s(self.design))
        except HeadError as error:
            raise StudyError.about(
                f"condition {made.condition.name}",
                found=str(error),
                allowed="a head with lips and landmarks",
                remedy="give it a level",
            ) from None
        heard = None if made.condition.silent else self._hear(made, voice)
        seen = look(face.mouth, heard)
        return Sight(seen, strength(seen, self.weights), face)

    def _hear(self, made: ClipMaking, voice: Waveform) -> HeardSound:
        from elocute.speech.timed_phones import find_phones

        key = made.heard_file, made.sound.start_s, made.sound.end_s
        if key not in self._heard:
            self._heard[key] = hear(voice, find_phones(voice).phones)
        return self._heard[key]


class Raters(Truth):
    """What raters find of each clip of a study; `crowd_answers` takes it as its truth.

    Parameters
    ----------
    design : Design
        The study, with its sounds by name.
    sights : mapping of (str, str) to Sight
        By condition, `MISMATCHED` too, and SOUND.IDENTITY.
    levels : mapping of str to float
        Strengths of conditions that were not looked at.
    weights : Weights
        Of manners.
    """

    sync_bounds_ms = NOTICED_MS
    # Obvious items stay as sure as the crowd has them: raters measure another sentence less surely
    # than people see it, and who qualifies would be told wrongly.

    def __init__(
        self,
        design: Design,
        sights: Mapping[tuple[str, str], Sight],
        levels: Mapping[str, float],
        weights: Weights,
    ) -> None:
        super().__init__(design, Crowd(dict(levels)))
        self.sights, self.weights = sights, weights

    def strength(self, condition: str, stimulus: str) -> float:
        """How good a clip is: logits, or points of a rating."""
        if condition in self.levels:
            return self.levels[condition]
        found = self.sights[condition, _unseen_view(stimulus)].strength
        if self.design.study.kind != "rating":
            return found
        return 100 * _logistic(found + _logit(USUAL_POINTS / 100))

    def recognised(self, trial: Trial) -> float:
        """The logit of choosing the right one: whose landmarks are nearer the reference's."""
        right, wrong = trial.conditions
        if right in self.levels:
            return self.levels[right]
        clip = trial.reference_clip
        assert clip is not None
        named = [clip.condition, right, wrong]
        stated = next((each for each in named if each in self.levels), None)
        if stated is not None:
            raise StudyError.about(
                f"condition {right}",
                found=f"no level, and one of {stated}, which it is compared with",
                allowed="levels of all of them, or of none",
            )
        reference = self._manner(clip.condition, clip.stimulus)
        apart = [
            float(np.sqrt(np.mean(np.square(self._manner(each, trial.stimulus) - reference))))
            for each in (right, wrong)
        ]
        return self.weights.manner * (apart[1] - apart[0])

    def _manner(self, condition: str, stimulus: str) -> Float64Array:
        return self.sights[condition, _unseen_view(stimulus)].face.manner

    def late_ms(self, condition: str) -> float:
        """How late a sound is against what the face does, by all its clips."""
        offset = super().late_ms(condition)
        if condition in self.levels:
            return offset
        return offset + 1000 * float(np.median(self._of(condition, "late_s")))

    def _of(self, condition: str, measure: str) -> list[float]:
        return [
            getattr(sight.seen, measure)
            for (name, _), sight in self.sights.items()
            if name == condition
        ]

    def table(self) -> dict[str, dict[str, float]]:
        """Means over clips of what is seen in each condition.

        Returns
        -------
        dict of str to dict of str to float
            By condition: `strength` in logits, and the measures of `Seen`; NaN of what no clip
            has.
        """
        told: dict[str, dict[str, float]] = {}
        for condition in dict.fromkeys(name for name, _ in self.sights):
            mine = [sight for (name, _), sight in self.sights.items() if name == condition]
            row = {"strength": float(np.mean([each.strength for each in mine]))}
            for measure in fields(Seen):
                values = np.array(self._of(condition, measure.name))
                known = values[np.isfinite(values)]
                row[measure.name] = float(known.mean()) if len(known) else float("nan")
            told[condition] = row
        return told


def _logistic(logit: float) -> float:
    return float(0.5 * (1 + np.tanh(logit / 2)))


def _logit(share: float) -> float:
    return float(np.log(share / (1 - share)))
