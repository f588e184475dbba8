"""Which trials a study has, and in which order and on which sides each person sees them.

Everything follows from the design, its seed and a person's place in the assignment: the same three
give the same sequence anywhere.

Trials are dealt out to blocks so that each block has every pair of conditions equally often, to
one, and stimuli as evenly as numbers allow. Of two people who follow each other in a block, the
second sees every pair with its sides exchanged.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from random import Random

from elocute.study.design.design import MISMATCHED, SYNC_ANSWERS, Design

SHUFFLES = 40
"""Orders that are tried for one in which no stimulus follows itself."""
ANSWER_S = 4.0
"""What reading and answering takes beside watching, for the estimated time."""
WATCHED = 1.4
"""How often people watch a clip on average, for the estimated time."""
CHECKS_S = 90.0


@dataclass(frozen=True, order=True)
class Clip:
    """One video: a condition that says a stimulus."""

    condition: str  # its name, or `design.MISMATCHED`
    stimulus: str  # SOUND.IDENTITY.VIEW

    @property
    def name(self) -> str:
        """Of its file, below the folder of videos."""
        return f"{self.condition}/{self.stimulus}"


@dataclass(frozen=True, order=True)
class Pair:
    """Two clips of one stimulus in one video, side by side over one sound."""

    left: str
    right: str
    stimulus: str

    @property
    def name(self) -> str:
        """Of its file, below the folder of pairs."""
        return f"{self.left}+{self.right}/{self.stimulus}"

    @property
    def clips(self) -> tuple[Clip, Clip]:
        """What it is made of."""
        return Clip(self.left, self.stimulus), Clip(self.right, self.stimulus)


@dataclass(frozen=True)
class Trial:
    """One question, the same for all who are asked it."""

    name: str  # of the trial, in the table of answers
    # As in the table.
    kind: str
    role: str
    stimulus: str  # SOUND.IDENTITY.VIEW
    conditions: tuple[str, ...]  # two that are compared, or the one that is judged
    reference: str = ""  # the condition of the reference clip, or ""
    # What is shown as reference; of a rating by mushra it has the trial's own stimulus.
    reference_clip: Clip | None = None
    correct: str = ""  # the answer that is right, or ""
    words: tuple[str, ...] = ()  # the words that are offered, where it is one that is asked for


@dataclass(frozen=True)
class Shown:
    """A trial as one person sees it."""

    order: int  # from 1
    trial: Trial  # what is asked
    # Conditions; `right` is "" where one is judged.
    left: str
    right: str
    words: tuple[str, ...] = ()  # in this person's order

    @property
    def offers(self) -> tuple[str, ...]:
        """What may be answered: sides or words; () for a number from 0 to 100."""
        return ("left", "right") if self.right else self.words


def test_trials(design: Design) -> list[list[Trial]]:
    """All trials of a design: a list, in the order of the stimuli, for each pair or condition."""
    kind = design.study.kind
    if kind == "binary":
        return [
            [_binary(stimulus, pair) for stimulus in design.stimuli.names] for pair in design.pairs
        ]
    if kind == "style":
        return _style_trials(design)
    return [
        [_single(design, stimulus, each.name) for stimulus in design.stimuli.names]
        for each in design.judged
    ]


def _binary(stimulus: str, pair: tuple[str, str]) -> Trial:
    return Trial(f"{stimulus}.{pair[0]}.{pair[1]}", "binary", "test", stimulus, pair)


def _single(design: Design, stimulus: str, condition: str) -> Trial:
    kind = design.study.kind
    trial = Trial(f"{stimulus}.{condition}", kind, "test", stimulus, (condition,))
    if kind == "rating":
        reference = design.comparisons.reference if design.study.scale == "mushra" else ""
        clip = Clip(reference, stimulus) if reference else None
        return replace(trial, reference=reference, reference_clip=clip)
    if kind == "sync":
        offset = design.condition(condition).offset_ms
        correct = SYNC_ANSWERS[1 + (offset > 0) - (offset < 0)]
        return replace(trial, correct=correct, words=SYNC_ANSWERS)
    name = stimulus.partition(".")[0]
    sound = next(each for each in design.stimuli.sounds if each.name == name)
    return replace(trial, correct=sound.word, words=sound.choices)


def _style_trials(design: Design) -> list[list[Trial]]:
    contents = ("same", "different")
    asked = [each for each in contents if design.comparisons.content in (each, "both")]
    return [
        [
            _style(design, stimulus, (one, other), right, content)
            for content in asked
            for stimulus in design.stimuli.names
        ]
        for one, other in design.pairs
        for right in (one, other)
    ]


def _style(design: Design, stimulus: str, pair: tuple[str, str], right: str, content: str) -> Trial:
    clips = [each.name for each in design.conditions if each.reference_for == right]
    condition = clips[0] if clips else right
    shown = stimulus if content == "same" else other_stimulus(design, stimulus)
    wrong = pair[1] if right == pair[0] else pair[0]
    name = f"{stimulus}.{right}.{wrong}.{content}"
    clip = Clip(condition, shown)
    return Trial(name, "style", "test", stimulus, (right, wrong), condition, clip, right)


def other_stimulus(design: Design, stimulus: str) -> str:
    """The same face and view with the next sound of a design that has two or more."""
    sound, _, rest = stimulus.partition(".")
    named = [each.name for each in design.stimuli.sounds]
    return f"{named[(named.index(sound) + 1) % len(named)]}.{rest}"


def obvious_trials(design: Design) -> list[Trial]:
    """Items whose answer is obvious: one side moves to the sound of another sentence.

    As many as qualification and catch trials need, at most one for each stimulus; their role is
    "qualification" until they are shown.
    """
    wanted = design.qualification.items + catches_of(design)
    stimuli = list(design.stimuli.names)
    Random(f"{design.study.seed}/obvious").shuffle(stimuli)
    return [
        Trial(
            f"{stimulus}.{design.obvious}.{MISMATCHED}",
            "binary",
            "qualification",
            stimulus,
            (design.obvious, MISMATCHED),
            correct=design.obvious,
        )
        for stimulus in stimuli[:wanted]
    ]


def block_count(design: Design) -> int:
    """How many blocks the trials are dealt out to."""
    trials = sum(map(len, test_trials(design)))
    if design.assignment.trials:
        return max(1, math.ceil(trials / design.assignment.trials))
    return max(1, min(design.assignment.blocks, trials))


def catches_of(design: Design) -> int:
    """Catch trials that a person meets."""
    if not design.catch.every:
        return 0
    trials = sum(map(len, test_trials(design)))
    return round(math.ceil(trials / block_count(design)) / design.catch.every)


def block_trials(design: Design, block: int) -> list[Trial]:
    """The test trials of one block, numbered from 1."""
    return _dealt(design)[block - 1]


@lru_cache(maxsize=8)
def _dealt(design: Design) -> list[list[Trial]]:
    """All trials in their blocks: of each pair equally many, and stimuli as evenly as may be."""
    rng = Random(f"{design.study.seed}/blocks")
    blocks: list[list[Trial]] = [[] for _ in range(block_count(design))]
    met: list[Counter[str]] = [Counter() for _ in blocks]
    for row in test_trials(design):
        left = rng.sample(row, len(row))
        while left:
            # One to each block in turn, and what does not go round to the smallest.
            order = rng.sample(range(len(blocks)), len(blocks))
            for place in sorted(order, key=lambda each: len(blocks[each]))[: len(left)]:
                trial = min(left, key=lambda each, seen=met[place]: seen[each.stimulus])
                left.remove(trial)
                blocks[place].append(trial)
                met[place][trial.stimulus] += 1
    return blocks


def sequence(design: Design, block: int, visit: int) -> list[Shown]:
    """All that one person sees, in order: by block, from 1, and how many had this block before."""
    rng = Random(f"{design.study.seed}/{block}/{visit}")
    # Two who follow each other draw the same sides, and the second exchanges them.
    sides = Random(f"{design.study.seed}/{block}/{visit // 2}/sides")
    exchanged = visit % 2 == 1
    tests = block_trials(design, block)
    flips = dict(zip((each.name for each in tests), _half(len(tests), sides), strict=True))
    repeated = rng.sample(tests, min(design.assignment.repeats, len(tests)))
    order = _ordered(design, tests, rng) + _ordered(design, repeated, rng)
    shown: list[tuple[Trial, bool]] = []
    met: set[str] = set()
    for trial in order:
        shown.append((trial, flips[trial.name] ^ exchanged ^ (trial.name in met)))
        met.add(trial.name)
    obvious = obvious_trials(design)
    rng.shuffle(obvious)
    first = [obvious[n % len(obvious)] for n in range(design.qualification.items)]
    asked = [(trial, side) for trial, side in zip(first, _half(len(first), rng), strict=True)]
    shown = _with_catches(design, shown, obvious, rng)
    practice = [
        (replace(each, role="practice"), rng.random() < 0.5) for each in _practice(design, rng)
    ]
    return [
        _shown(place, trial, side, rng)
        for place, (trial, side) in enumerate([*practice, *asked, *shown], 1)
    ]


def _half(count: int, rng: Random) -> list[bool]:
    """As many of one side as of the other, to one, in random order."""
    sides = [place % 2 == 0 for place in range(count)]
    if count % 2 and rng.random() < 0.5:
        sides = [not side for side in sides]
    rng.shuffle(sides)
    return sides


def _practice(design: Design, rng: Random) -> list[Trial]:
    every = [trial for trials in test_trials(design) for trial in trials]
    return rng.sample(every, min(design.watching.practice, len(every)))


def _ordered(design: Design, trials: Sequence[Trial], rng: Random) -> list[Trial]:
    """In random order: by stimulus where a reference stays, else no stimulus after itself."""
    if design.study.kind == "rating" and design.study.scale == "mushra":
        stimuli = sorted({each.stimulus for each in trials})
        rng.shuffle(stimuli)
        order = []
        for stimulus in stimuli:
            of_it = [each for each in trials if each.stimulus == stimulus]
            order += rng.sample(of_it, len(of_it))
        return order
    best, fewest = list(trials), len(trials) + 1
    for _ in range(SHUFFLES):
        order = rng.sample(list(trials), len(trials))
        twice = sum(a.stimulus == b.stimulus for a, b in pairwise(order))
        if twice < fewest:
            best, fewest = order, twice
        if not fewest:
            break
    return best


def _with_catches(
    design: Design, shown: list[tuple[Trial, bool]], obvious: list[Trial], rng: Random
) -> list[tuple[Trial, bool]]:
    """Obvious items, one in every part of the sequence, each at a random place of its part."""
    count = catches_of(design)
    if not count or not obvious:
        return shown
    # Those that were not among the qualification, as far as there are any.
    later = obvious[design.qualification.items :] or obvious
    sides = _half(count, rng)
    mixed = list(shown)
    for number in reversed(range(count)):
        begin, end = (len(shown) * part // count for part in (number, number + 1))
        trial = replace(later[number % len(later)], role="catch")
        mixed.insert(rng.randint(begin + min(1, end - begin), end), (trial, sides[number]))
    return mixed


def _shown(order: int, trial: Trial, exchanged: bool, rng: Random) -> Shown:
    if len(trial.conditions) == 2:
        left, right = trial.conditions[::-1] if exchanged else trial.conditions
        return Shown(order, trial, left, right)
    words = trial.words
    if words != SYNC_ANSWERS:
        words = tuple(rng.sample(words, len(words)))
    return Shown(order, trial, trial.conditions[0], "", words)


def clip_pair(one: str, other: str, stimulus: str) -> Pair:
    """The file that has two conditions side by side, whichever is where."""
    left, right = sorted((one, other))
    return Pair(left, right, stimulus)


def videos_of(trial: Trial) -> list[Clip | Pair]:
    """The videos that a trial plays, the reference first."""
    if trial.kind == "rating" and trial.reference:
        return [clip_pair(trial.reference, trial.conditions[0], trial.stimulus)]
    before = [trial.reference_clip] if trial.reference_clip else []
    if len(trial.conditions) == 2:
        return [*before, clip_pair(*trial.conditions, trial.stimulus)]
    return [*before, Clip(trial.conditions[0], trial.stimulus)]


def all_videos(design: Design) -> tuple[list[Clip], list[Pair]]:
    """Every clip and every pair that somebody may see, sorted.

    Also clips that only pairs are made of.
    """
    trials = [trial for row in test_trials(design) for trial in row] + obvious_trials(design)
    shown = {video for trial in trials for video in videos_of(trial)}
    pairs = {each for each in shown if isinstance(each, Pair)}
    clips = {each for each in shown if isinstance(each, Clip)}
    clips |= {clip for pair in pairs for clip in pair.clips}
    return sorted(clips), sorted(pairs)


def minutes_of(shown: Sequence[Shown], seconds: dict[str, float]) -> float:
    """About how many minutes a person needs, by the seconds that each video lasts."""
    watched = sum(seconds.get(video.name, 0.0) for each in shown for video in videos_of(each.trial))
    return (watched * WATCHED + len(shown) * ANSWER_S + CHECKS_S) / 60
