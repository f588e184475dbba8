"""Which answers a report uses, by the rules that study.toml fixed before the first one was given.

A person leaves with all answers by the first rule that is broken; then single answers leave by
their time. Practice, qualification and catch trials are never among what is judged, and of trials
seen twice the first counts; the second tells how far a person agrees with themself.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from elocute.errors import StudyError
from elocute.study.design.design import MISMATCHED, SYNC_ANSWERS, Design
from elocute.study.report.answers import Answer

ONE_SIDE_MIN = 10
"""Answers from which on keeping to one side is no chance."""
MUSHRA_LEAST, MUSHRA_SHARE = 90.0, 0.15
"""ITU-R BS.1534-3, 4.1.2: who rates the hidden reference below the one in more than the other of
the items is left out."""


@dataclass(frozen=True)
class Exclusion:
    """A person whose answers are left out."""

    participant: str
    rule: str  # field of [exclusions], or "post-screening"
    found: str  # what the person did, in words
    answers: int  # test answers that are left out


@dataclass(frozen=True)
class Kept:
    """What is left for the report."""

    tests: list[Answer]  # test answers to be judged, each trial of a person once
    repeats: list[tuple[Answer, Answer]]  # first and second answer to the same trial
    obvious: list[Answer]  # qualification and catch answers of those who stay
    people: tuple[str, ...]  # who answered anything
    excluded: list[Exclusion]  # who left
    # Single answers that left.
    too_soon: int
    too_late: int


def check_answers(design: Design, answers: Sequence[Answer]) -> None:
    """Raise StudyError for answers that this study cannot have been given."""
    names = {each.name for each in design.conditions} | {MISMATCHED}
    choices = {each.name: each.choices for each in design.stimuli.sounds}
    seen: set[tuple[str, int]] = set()
    for row, each in enumerate(answers, 1):
        place = each.participant, each.order
        if place in seen:
            raise StudyError.about(
                f"answers row {row}",
                found=f"{each.participant} with order {each.order} twice",
                allowed="each place of a person's sequence once",
            )
        seen.add(place)
        for name in (each.left, each.right, each.reference):
            if name and name not in names:
                raise StudyError.about(
                    f"answers row {row}",
                    found=f"condition {name!r}",
                    allowed=f"a condition of {design.path}",
                    remedy="is it another study's table?",
                )
        if each.role == "test" and each.kind != design.study.kind:
            raise StudyError.about(
                f"answers row {row} `kind`", found=each.kind, allowed=design.study.kind
            )
        _check_answer(row, each, choices.get(each.stimulus.partition(".")[0], ()))


def _check_answer(row: int, answer: Answer, choices: Sequence[str]) -> None:
    allowed: Sequence[str] = ()
    if answer.kind in ("binary", "style"):
        if not answer.right or answer.left == answer.right:
            raise StudyError.about(
                f"answers row {row} `right`", found=repr(answer.right), allowed="another condition"
            )
        allowed = (answer.left, answer.right)
    elif answer.kind == "sync":
        allowed = SYNC_ANSWERS
    elif answer.kind == "intelligibility":
        allowed = choices
    elif not 0 <= _number(answer.answer) <= 100:
        raise StudyError.about(
            f"answers row {row} `answer`", found=repr(answer.answer), allowed="a number, 0 to 100"
        )
    if allowed and answer.answer not in allowed:
        raise StudyError.about(
            f"answers row {row} `answer`", found=repr(answer.answer), allowed=", ".join(allowed)
        )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def keep(design: Design, answers: Sequence[Answer]) -> Kept:
    """Apply the rules of a study to its table, in any order.

    Raises StudyError for answers that this study cannot have been given.
    """
    check_answers(design, answers)
    of_person: dict[str, list[Answer]] = defaultdict(list)
    for each in sorted(answers, key=lambda each: (each.participant, each.order)):
        of_person[each.participant].append(each)
    lengths = _sequence_lengths(of_person.values())
    excluded, tests, repeats, obvious = [], [], [], []
    soon = late = 0
    for person, own in of_person.items():
        broken = _broken(design, own, lengths)
        if broken:
            count = sum(each.role == "test" for each in own)
            excluded.append(Exclusion(person, *broken, count))
            continue
        obvious += [each for each in own if each.role in ("qualification", "catch")]
        first: dict[str, Answer] = {}
        for each in (each for each in own if each.role == "test"):
            if each.seconds < design.exclusions.seconds_min:
                soon += 1
            elif each.seconds > design.exclusions.seconds_max:
                late += 1
            elif each.trial in first:
                repeats.append((first[each.trial], each))
            else:
                first[each.trial] = each
        tests += first.values()
    return Kept(tests, repeats, obvious, tuple(of_person), excluded, soon, late)


def _sequence_lengths(people: Iterable[Sequence[Answer]]) -> Mapping[int, int]:
    """How long the sequence of each group is, by who came furthest in it."""
    lengths: Counter[int] = Counter()
    for answers in people:
        for each in answers:
            lengths[each.group] = max(lengths[each.group], each.order)
    return lengths


def _broken(
    design: Design, answers: Sequence[Answer], lengths: Mapping[int, int]
) -> tuple[str, str] | None:
    """The first rule that a person broke, and how."""
    rules = design.exclusions
    asked = [each for each in answers if each.role == "qualification"]
    right = sum(each.answer == each.correct for each in asked)
    if rules.qualification and asked and right < min(design.qualification.needed, len(asked)):
        return "qualification", f"{right} of {len(asked)} right"
    catches = [each for each in answers if each.role == "catch"]
    missed = sum(each.answer != each.correct for each in catches)
    if missed > rules.catches_missed:
        return "catches_missed", f"{missed} of {len(catches)} missed"
    length = max(lengths[answers[0].group], len(answers))
    if len(answers) < rules.answered * length - 1e-9:
        return "answered", f"{len(answers)} of {length}"
    tests = [each for each in answers if each.role == "test"]
    sided = [each for each in tests if each.right]
    lefts = sum(each.answer == each.left for each in sided)
    most = max(lefts, len(sided) - lefts)
    if len(sided) >= ONE_SIDE_MIN and most > rules.one_side * len(sided) + 1e-9:
        side = "left" if lefts == most else "right"
        return "one_side", f"{most} of {len(sided)} on the {side}"
    alike, twice = _alike(tests)
    if twice and alike < rules.repeats_agree * twice - 1e-9:
        return "repeats_agree", f"{alike} of {twice} alike"
    return _screened(design, tests)


def _alike(tests: Sequence[Answer]) -> tuple[int, int]:
    """Trials answered alike twice, and trials answered twice."""
    first: dict[str, Answer] = {}
    alike = twice = 0
    for each in tests:
        before = first.setdefault(each.trial, each)
        if before is not each:
            twice += 1
            alike += before.answer == each.answer
    return alike, twice


def _screened(design: Design, tests: Sequence[Answer]) -> tuple[str, str] | None:
    reference = design.comparisons.reference
    if design.study.kind != "rating" or design.study.scale != "mushra" or not reference:
        return None
    hidden = [each for each in tests if each.left == reference]
    low = sum(float(each.answer) < MUSHRA_LEAST for each in hidden)
    if low > MUSHRA_SHARE * len(hidden):
        return "post-screening", f"hidden reference below 90 in {low} of {len(hidden)}"
    return None
