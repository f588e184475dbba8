"""Find what is wrong with a corpus before it is used for training.

A corpus of any size is read once, clip by clip; what is kept are the findings and a few sums for
each subject.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.corpus.audio_sync import LAG_MAX_S, LagSums, SyncOffset, estimate_offset, lag_sums
from elocute.corpus.corpus_store import Corpus
from elocute.corpus.frame_rates import TOLERANCE, fitting_rate
from elocute.corpus.length_units import HEIGHT_RANGE_M, fitting_unit, is_head_sized, longest_side
from elocute.corpus.motion_checks import (
    MotionFacts,
    MotionRegions,
    examine_motion,
    find_motion_regions,
)
from elocute.corpus.split import ClipEntry, Split, find_leaks
from elocute.errors import AudioError

TURN_MAX_DEG, SHIFT_MAX_MM = 2.0, 5.0
LENGTH_MAX_FRAMES = 2.0
LENGTH_ERROR_S = 0.5
LENGTH = "length:"
SAME_RATIO_CLIPS = 3
STILL_MM = 0.3  # mean distance of the mouth from rest: its range in a clip that hardly moves
LOUD_RMS = 0.01
OFFSET_MAX_S = 0.1
POOLED_SECONDS, POOLED_GAIN, POOLED_R = 8.0, 0.08, 0.25
CLIP_SECONDS, CLIP_GAIN, CLIP_R = 4.0, 0.25, 0.5
SAME_OFFSET_S = 0.06


@dataclass(frozen=True)
class Finding:
    """Something that is wrong with a corpus.

    Attributes
    ----------
    level : str
        "error" or "warning".
    about : str
        A clip, a subject, a split, or "corpus".
    what : str
        What was found.
    frame : int or None
        Where in the clip.
    """

    level: str
    about: str
    what: str
    frame: int | None = None


@dataclass(frozen=True)
class _Length:
    """A clip whose sound and motion are not equally long."""

    level: str
    frames: int
    seconds: float


@dataclass
class _SyncSums:
    """Correlation sums by subject, and clips that are out of sync by themselves."""

    subjects: dict[str, LagSums] = field(default_factory=dict)
    clips: list[tuple[str, str, SyncOffset]] = field(default_factory=list)

    def add(self, entry: ClipEntry, sums: LagSums) -> None:
        """Add a clip, and note it where it alone is clearly out of sync."""
        known = self.subjects.get(entry.subject)
        self.subjects[entry.subject] = sums if known is None else known + sums
        offset = estimate_offset(sums)
        sure = sums.seconds >= CLIP_SECONDS and offset.gain > CLIP_GAIN and offset.r > CLIP_R
        if sure and OFFSET_MAX_S < abs(offset.seconds) < 0.9 * LAG_MAX_S:
            self.clips.append((entry.name, entry.subject, offset))


def check_corpus(corpus: Corpus, progress: Callable[[float], None] | None = None) -> list[Finding]:
    """Check a corpus in one pass over its clips.

    Looks for numbers that are not finite; units other than metres; jumps; clips that are turned or
    shifted against their template; clips that do not move; sound that is missing, cut short, of
    another length or at another time than the motion; and splits whose parts share something.

    Parameters
    ----------
    corpus : Corpus
        The corpus.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of Finding
        Those about the whole corpus first; empty where nothing is wrong.
    """
    findings = list(_template_findings(corpus))
    findings += _split_findings(corpus)
    regions = find_motion_regions(corpus)
    sums = _SyncSums()
    clips: list[Finding] = []
    lengths: list[_Length] = []
    for done, entry in enumerate(corpus.entries, 1):
        clips += _clip_findings(corpus, entry, regions, sums, lengths)
        if progress:
            progress(done / len(corpus.entries))
    rate = _wrong_rate(corpus, lengths)
    if rate is not None:
        clips = [finding for finding in clips if not finding.what.startswith(LENGTH)]
        findings.append(rate)
    return [*findings, *_offset_findings(sums), *clips]


def _template_findings(corpus: Corpus) -> Iterator[Finding]:
    """Neutral faces that are not finite, or not of a head's size in metres."""
    for subject in corpus.subjects:
        template = np.asarray(corpus.template(subject))
        if not np.isfinite(template).all():
            yield Finding("error", subject, "template: NaN or infinity")
            continue
        size = longest_side(template)
        if not is_head_sized(size):
            low, high = HEIGHT_RANGE_M
            unit = fitting_unit(size)
            fits = f"it fits a head in {unit}" if unit else "no unit fits"
            text = f"template: {size:.4g} m high, a head has {low:g} to {high:g} m; {fits}"
            yield Finding("error", subject, text)


def _split_findings(corpus: Corpus) -> Iterator[Finding]:
    """What the parts of each split share."""
    # One or two people cannot be split by subject: measures then hold for them alone.
    few = len(corpus.subjects) < 3
    for name, split in corpus.splits.items():
        lines = find_leaks(corpus.entries, split)
        if not few and _by_sentence(corpus, split, lines):
            text = "parts share subjects but no sentence: measures hold for these people alone"
            yield Finding("warning", f"split {name}", text)
            continue
        for line in lines:
            level = "warning" if few and line.startswith("subject ") else "error"
            yield Finding(level, f"split {name}", line)


def _by_sentence(corpus: Corpus, split: Split, lines: list[str]) -> bool:
    """Whether a split divides sentences on purpose, as BIWI-Test-A and BIWI-Test-B do.

    The subjects of validation and of test are then all in training, or none of them is, and no
    sentence is shared.
    """
    train, *others = (
        {corpus.entry(clip).subject for clip in clips} for clips in split.parts().values()
    )
    shared = all(line.startswith("subject ") for line in lines)
    return bool(lines) and shared and all(part <= train or not part & train for part in others)


def _clip_findings(
    corpus: Corpus,
    entry: ClipEntry,
    regions: MotionRegions,
    sums: _SyncSums,
    lengths: list[_Length],
) -> Iterator[Finding]:
    """What is wrong with one clip; adds to the sums and lengths."""
    facts = examine_motion(corpus, entry.name, regions)
    yield from _motion_findings(entry, facts)
    try:
        sound = corpus.sound(entry.name)
    except AudioError as error:
        yield Finding("error", entry.name, f"sound: {error}")
        return
    gap = sound.duration_s - entry.frames / corpus.fps
    if abs(gap) * corpus.fps > LENGTH_MAX_FRAMES:
        level = "error" if abs(gap) > LENGTH_ERROR_S else "warning"
        than = "longer" if gap > 0 else "shorter"
        lengths.append(_Length(level, entry.frames, sound.duration_s))
        yield Finding(level, entry.name, f"{LENGTH} sound is {abs(gap):.2f} s {than} than motion")
    if facts.broken is not None:
        return
    if _loud(sound) and np.ptp(facts.activity) < STILL_MM:
        text = f"still: the mouth moves {np.ptp(facts.activity):.2f} mm though somebody speaks"
        yield Finding("error", entry.name, text)
        return
    measured = lag_sums(sound, facts.activity, corpus.fps)
    if measured is not None:
        sums.add(entry, measured)


def _wrong_rate(corpus: Corpus, lengths: list[_Length]) -> Finding | None:
    """One finding in place of many where most lengths are off by one ratio."""
    if len(lengths) < SAME_RATIO_CLIPS or 2 * len(lengths) < len(corpus.entries):
        return None
    rates = np.array([length.frames / length.seconds for length in lengths])
    middle = float(np.median(rates))
    if np.abs(rates / middle - 1).max() > TOLERANCE or abs(middle / corpus.fps - 1) < TOLERANCE:
        return None
    rate = fitting_rate(middle) or middle
    level = "error" if any(length.level == "error" for length in lengths) else "warning"
    text = (
        f"{LENGTH} in {len(lengths)} of {len(corpus.entries)} clips sound lasts "
        f"{corpus.fps / middle:.2f} times as long as motion at {corpus.fps:g} frames/s; at "
        f"{rate:.4g} they fit: convert the recordings anew, `fps` {rate:.4g}"
    )
    return Finding(level, "corpus", text)


def _motion_findings(entry: ClipEntry, facts: MotionFacts) -> Iterator[Finding]:
    """What is wrong with the motion of a clip."""
    if facts.broken is not None:
        yield Finding("error", entry.name, "motion: NaN or infinity", facts.broken)
        return
    if facts.jump is not None:
        text = f"jump: a vertex moves {facts.jump_mm:.1f} mm in one frame"
        yield Finding("error", entry.name, text, facts.jump)
    if facts.turned_deg > TURN_MAX_DEG or facts.shifted_mm > SHIFT_MAX_MM:
        text = (
            f"pose: turned {facts.turned_deg:.1f} degrees and shifted {facts.shifted_mm:.1f} mm "
            "against the template; unpose it"
        )
        yield Finding("error", entry.name, text, facts.posed)


def _loud(sound: Waveform) -> bool:
    """Whether the sound is loud enough for speech."""
    return float(np.sqrt(np.mean(np.square(sound.samples, dtype=np.float64)))) > LOUD_RMS


def _offset_findings(sums: _SyncSums) -> Iterator[Finding]:
    """Offsets of the corpus, then of subjects and clips that differ from what was said already."""
    if not sums.subjects:
        return
    parts = list(sums.subjects.values())
    whole = _sure_offset(sum(parts[1:], parts[0])) if len(parts) > 1 else None
    if whole is not None:
        yield Finding("error", "corpus", _offset_text(whole))
    for subject, part in sums.subjects.items():
        offset = _sure_offset(part)
        if offset is not None and not _is_said(offset, whole):
            yield Finding("error", subject, _offset_text(offset))
        for name, who, single in sums.clips:
            if who == subject and not _is_said(single, offset or whole):
                yield Finding("warning", name, _offset_text(single))


def _sure_offset(sums: LagSums) -> SyncOffset | None:
    """The offset of a subject or corpus, where it is large and clear."""
    offset = estimate_offset(sums)
    enough = sums.seconds >= POOLED_SECONDS and offset.gain > POOLED_GAIN and offset.r > POOLED_R
    return offset if enough and abs(offset.seconds) > OFFSET_MAX_S else None


def _is_said(offset: SyncOffset, said: SyncOffset | None) -> bool:
    """Whether an offset is the same as one that was said already."""
    return said is not None and abs(offset.seconds - said.seconds) < SAME_OFFSET_S


def _offset_text(offset: SyncOffset) -> str:
    """An offset in a finding."""
    than = "after" if offset.seconds > 0 else "before"
    return (
        f"offset: motion comes {1000 * abs(offset.seconds):.0f} ms {than} the sound "
        f"(correlation {offset.r:.2f}, {offset.gain:.2f} more than without)"
    )
