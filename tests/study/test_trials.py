"""Assignment: balanced, random, and the same for the same seed."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from elocute.study.design import trials
from elocute.study.design.design import (
    MISMATCHED,
    Assignment,
    Catch,
    Comparisons,
    Condition,
    Design,
    Qualification,
    Stimuli,
    StimulusSound,
    Study,
    Watching,
)
from elocute.study.design.design_file import read_design
from elocute.study.design.trials import (
    Clip,
    Pair,
    all_videos,
    block_count,
    block_trials,
    sequence,
    videos_of,
)

WORDS = ("bat", "mat", "pat", "cat")


def made(kind="binary", conditions=3, sounds=6, scale="mos", **sections):
    return Design(
        Study(title="T", kind=kind, contact="C", scale=scale),
        tuple(Condition(name=f"c{n}", model="articulation") for n in range(conditions)),
        Stimuli(sounds=tuple(StimulusSound(f"s{n}", f"s{n}.wav") for n in range(sounds))),
        **sections,
    )


def judged(shown):
    return [each for each in shown if each.trial.role == "test"]


@pytest.mark.parametrize("most", [0, 4, 5, 9, 18])
def test_every_trial_is_in_one_block_and_pairs_are_balanced(most):
    design = made(assignment=Assignment(trials=most))
    blocks = [block_trials(design, 1 + n) for n in range(block_count(design))]
    names = [each.name for block in blocks for each in block]
    assert len(names) == len(set(names)) == 18
    assert not most or max(map(len, blocks)) <= most
    for block in blocks:
        pairs = Counter(each.conditions for each in block)
        shares = [pairs[pair] for pair in design.pairs]
        assert max(shares) - min(shares) <= 1
        stimuli = Counter(each.stimulus for each in block)
        assert max(stimuli.values()) <= -(-len(block) // 6) + 1


def test_sides_are_even_and_the_next_person_sees_them_exchanged():
    design = made(assignment=Assignment(blocks=2))
    first, second = (judged(sequence(design, 1, visit)) for visit in (4, 5))
    firsts = sum(each.left == each.trial.conditions[0] for each in first)
    assert abs(2 * firsts - len(first)) <= 1
    lefts = {each.trial.name: each.left for each in first}
    assert all(lefts[each.trial.name] == each.right for each in second)
    assert [e.trial.name for e in first] != [e.trial.name for e in second]


def test_the_same_seed_gives_the_same_sequence_and_another_another():
    design = made()
    assert sequence(design, 1, 3) == sequence(made(), 1, 3)
    other = replace(design, study=replace(design.study, seed=2))
    assert sequence(design, 1, 3) != sequence(other, 1, 3)


def test_no_stimulus_follows_itself():
    for visit in range(10):
        shown = judged(sequence(made(catch=Catch(every=0)), 1, visit))
        stimuli = [each.trial.stimulus for each in shown]
        assert all(a != b for a, b in pairwise(stimuli))


def test_obvious_items_come_first_and_in_between():
    design = made(
        qualification=Qualification(items=3),
        catch=Catch(every=6),
        watching=Watching(practice=2),
    )
    shown = sequence(design, 1, 0)
    roles = [each.trial.role for each in shown]
    assert roles[:5] == ["practice"] * 2 + ["qualification"] * 3
    assert roles.count("catch") == 3 and roles.count("test") == 18
    assert [each.order for each in shown] == list(range(1, len(shown) + 1))
    for each in shown:
        if each.trial.role in ("qualification", "catch"):
            assert {each.left, each.right} == {"c0", MISMATCHED}
            assert each.trial.correct == "c0"


def test_repeats_come_later_with_their_sides_exchanged():
    design = made(assignment=Assignment(repeats=4), catch=Catch(every=0))
    shown = judged(sequence(design, 1, 0))
    assert len(shown) == 22
    first = {}
    repeated = 0
    for each in shown:
        before = first.setdefault(each.trial.name, each)
        if before is not each:
            repeated += 1
            assert (each.left, each.right) == (before.right, before.left)
    assert repeated == 4


def test_style_asks_for_either_condition_with_other_content():
    design = made("style", comparisons=Comparisons(content="different"), conditions=2)
    asked = [each for row in trials.test_trials(design) for each in row]
    assert len(asked) == 2 * 6
    for each in asked:
        assert each.correct == each.conditions[0] == each.reference
        assert each.reference_clip is not None
        assert each.reference_clip.stimulus != each.stimulus
        reference, pair = videos_of(each)
        assert isinstance(reference, Clip) and isinstance(pair, Pair)


def test_style_with_the_same_content_shows_clips_of_their_own():
    own = Condition(name="ref0", videos="a", reference_for="c0")
    base = made("style", comparisons=Comparisons(content="different"), conditions=2)
    other = replace(own, name="ref1", reference_for="c1")
    design = replace(
        base, conditions=(*base.conditions, own, other), comparisons=Comparisons(content="both")
    )
    asked = [each for row in trials.test_trials(design) for each in row]
    assert {each.reference for each in asked} == {"ref0", "ref1"}
    same = [each for each in asked if each.name.endswith(".same")]
    assert len(same) == 12
    assert all(e.reference_clip and e.reference_clip.stimulus == e.stimulus for e in same)


def test_mushra_keeps_to_a_stimulus_and_shows_the_reference_beside():
    design = made("rating", scale="mushra", comparisons=Comparisons(reference="c0"))
    shown = judged(sequence(design, 1, 0))
    stimuli = [each.trial.stimulus for each in shown]
    changes = sum(a != b for a, b in pairwise(stimuli))
    assert changes == 5 and len(shown) == 18  # the hidden reference is rated too
    (video,) = videos_of(shown[0].trial)
    assert isinstance(video, Pair) and "c0" in (video.left, video.right)
    assert shown[0].offers == () and shown[0].right == ""


def test_words_are_offered_in_another_order_to_each():
    sounds = tuple(
        StimulusSound(f"s{n}", f"s{n}.wav", word=WORDS[n % 4], choices=WORDS) for n in range(6)
    )
    design = replace(
        made(), study=replace(made().study, kind="intelligibility"), stimuli=Stimuli(sounds=sounds)
    )
    orders = {each.words for v in range(4) for each in judged(sequence(design, 1, v))}
    assert len(orders) > 5 and all(sorted(each) == sorted(WORDS) for each in orders)
    assert all(e.trial.correct in WORDS for e in judged(sequence(design, 1, 0)))


def test_an_offset_says_which_answer_is_right():
    base = made("sync", conditions=3)
    offsets = (-120.0, 0.0, 120.0)
    design = replace(
        base,
        conditions=tuple(
            replace(each, offset_ms=offset)
            for each, offset in zip(base.conditions, offsets, strict=True)
        ),
    )
    correct = {e.left: e.trial.correct for e in judged(sequence(design, 1, 0))}
    assert correct == {"c0": "early", "c1": "together", "c2": "late"}


def test_only_what_somebody_may_see_is_made():
    clips, pairs = all_videos(made(comparisons=Comparisons(against="c0")))
    assert {(each.left, each.right) for each in pairs} == {
        ("c0", "c1"),
        ("c0", "c2"),
        ("c0", MISMATCHED),
    }
    assert {each.condition for each in clips} == {"c0", "c1", "c2", MISMATCHED}


def test_the_published_counts_are_those_of_the_paper():
    studies = Path(__file__).parents[2] / "studies"
    for name, answers in (("voca_binary", 400), ("voca_ablation", 400), ("voca_styles", 800)):
        design = read_design(studies / f"{name}.toml")
        people = design.assignment.participants
        assert people % block_count(design) == 0
        seen = [len(block_trials(design, 1 + n)) for n in range(block_count(design))]
        assert sum(seen) * people // block_count(design) == answers
        assert (design.qualification.items, design.qualification.right) == (3, 3)
        assert design.qualification.failed == "stop"
