"""Raters who look: what may be blamed in each condition of a study, before people are asked.

    python -m recipes.study_raters.raters studies/example.toml

They measure each clip's motion as it is shown (`seen_mouths`) and weigh what they see to a strength
in logits (`Weights`), which `elocute study simulate --level CONDITION=NUMBER` takes. One weight,
that of timing, follows from what delays people notice; the others are set by hand. They know
nothing of who speaks, how a face looks, or what makes a recording of somebody better than a good
prediction: a model, and no people. Conditions of videos are left out, and views: raters see a face
alike from everywhere.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.speech.timed_phones import find_phones
from elocute.study.design.design import MISMATCHED, Design
from elocute.study.design.trials import Clip, all_videos
from elocute.study.stimuli.manifest import known_design
from elocute.study.stimuli.stimuli import ClipMaking, pad_s
from elocute.study.stimuli.stimulus_pictures import shown_motion
from recipes.study_raters.seen_faces import see
from recipes.study_raters.seen_mouths import (
    HeardSound,
    PeopleSeen,
    Seen,
    hear,
    look,
    people_seen,
    unusual,
)

CALM, LIVELY = ("head", "lids"), ("jerk", "false seals")
TOLD = ("strength", "fit", "late_s", "missed_seals", "false_seals", "opening_mm", "shut")
"""Columns of the table that is printed."""


@dataclass(frozen=True)
class Weights:
    """What raters make of what they see, in logits: set by hand but for that of timing."""

    timing: float = 1.0  # of bad timing, as multiple of what people notice of delays
    missed_seals: float = 2.0  # of lips that stay open at every p, b and m
    missed_teeth: float = 1.0  # of a lower lip away from the teeth at every f and v
    unusual: float = 0.5  # of each spread by which an amount is beyond what is usual
    unusual_most: float = 3.0  # spreads that count at most


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


def watch_study(study: Path, data: Path | None = None) -> dict[str, dict[str, float]]:
    """What raters see in each condition of a study that has motion: means over its clips.

    Parameters
    ----------
    study : Path
        study.toml, or a study's folder.
    data : Path, optional
        Where the names in the file begin; by default its own folder.

    Returns
    -------
    dict of str to dict of str to float
        By condition: `strength` in logits, 0 with nothing to blame, and the measures of `Seen`; NaN
        of what no clip has.
    """
    begins = data or (study if study.is_dir() else study.parent)
    design, _ = known_design(study, begins)
    clips = {}
    for clip in all_videos(design)[0]:
        named = design.obvious if clip.condition == MISMATCHED else clip.condition
        if not design.condition(named).videos:
            clips[clip.condition, clip.stimulus.rpartition(".")[0]] = clip
    heard: dict[tuple[Path, float, float], HeardSound] = {}
    rows: dict[str, list[dict[str, float]]] = {}
    for (condition, _), clip in clips.items():
        seen = _seen(design, begins, clip, heard)
        rows.setdefault(condition, []).append({"strength": strength(seen), **asdict(seen)})
    return {name: {key: _mean([r[key] for r in of]) for key in of[0]} for name, of in rows.items()}


def _seen(
    design: Design, data: Path, clip: Clip, heard: dict[tuple[Path, float, float], HeardSound]
) -> Seen:
    """The measures of one clip; what was heard once is kept in `heard`."""
    making = ClipMaking(design, data, clip)
    voice = making.voice()
    times = making.times(voice.duration_s + 2 * pad_s(design))
    source = replace(making.source, voice=making.moving_voice(voice))
    mouth = see(shown_motion(source, times, around=making.mismatched), -pad_s(design))
    if making.condition.silent:
        return look(mouth, None)
    key = making.heard_file, making.sound.start_s, making.sound.end_s
    if key not in heard:
        heard[key] = _hear(voice)
    return look(mouth, heard[key])


def _hear(voice: Waveform) -> HeardSound:
    return hear(voice, find_phones(voice).phones)


def _mean(values: list[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("study", type=Path, help="a study's folder, or its file")
    parser.add_argument("--data", type=Path, help="where the names in the file begin")
    given = parser.parse_args()
    print("| condition | " + " | ".join(TOLD) + " |\n|---|" + "---|" * len(TOLD))
    for name, row in watch_study(given.study, given.data).items():
        print(f"| {name} | " + " | ".join(f"{row[key]:.2f}" for key in TOLD) + " |")


if __name__ == "__main__":
    main()
