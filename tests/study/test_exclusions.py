"""Who and what is left out, by the rules of the study, and answers that no study can have."""

from __future__ import annotations

from dataclasses import replace

import pytest

from elocute.errors import StudyError
from elocute.study.crowd import Crowd, crowd_answers, seats_of
from elocute.study.design.design import Analysis, Exclusions
from elocute.study.report.answers import Answer
from elocute.study.report.exclusions import keep
from tests.study.designs import design_of

DESIGN = design_of()
LEVELS = {"talkers": 1.0, "voca": -0.5}


@pytest.fixture(scope="module")
def honest() -> list[Answer]:
    """Of twelve people who never lapse and miss nothing that is obvious."""
    return crowd_answers(DESIGN, Crowd(LEVELS, lapses=0), seats_of(DESIGN, 12), 0)


def changed(answers, person: str, role: str, count: int, **values) -> list[Answer]:
    """The table with the first answers of a person in a role changed."""
    rows = []
    for each in answers:
        if each.participant == person and each.role == role and count:
            count -= 1
            answer = each.right if each.answer == each.left else each.left
            each = replace(each, **(values or {"answer": answer}))
        rows.append(each)
    return rows


def rules_of(design, answers) -> list[tuple[str, str, str]]:
    return [(each.participant, each.rule, each.found) for each in keep(design, answers).excluded]


WHO = "simulated-00003"


def test_people_who_look_stay(honest):
    found = keep(DESIGN, honest)
    assert not found.excluded and len(found.people) == 12
    assert len(found.tests) == 12 * 24 and len(found.repeats) == 12 * 2
    assert {each.role for each in found.obvious} == {"qualification", "catch"}
    assert {each.role for each in found.tests} == {"test"}


@pytest.mark.parametrize(
    ("role", "count", "told"),
    [
        ("qualification", 1, ("qualification", "2 of 3 right")),
        ("catch", 2, ("catches_missed", "2 of 2 missed")),
    ],
)
def test_who_misses_the_obvious_is_left_out(honest, role, count, told):
    table = changed(honest, WHO, role, count)
    assert rules_of(DESIGN, table) == [(WHO, *told)]
    assert not any(each.participant == WHO for each in keep(DESIGN, table).tests)
    lenient = replace(DESIGN, exclusions=Exclusions(qualification=False, catches_missed=9))
    assert rules_of(lenient, table) == []


def test_one_catch_may_be_missed(honest):
    assert rules_of(DESIGN, changed(honest, WHO, "catch", 1)) == []


def test_who_stops_in_the_middle_is_left_out(honest):
    table = [each for each in honest if each.participant != WHO or each.order <= 20]
    assert rules_of(DESIGN, table) == [(WHO, "answered", "20 of 32")]
    half = replace(DESIGN, exclusions=Exclusions(answered=0.5))
    assert rules_of(half, table) == []


def test_who_keeps_to_one_side_is_left_out(honest):
    table = [
        replace(each, answer=each.left) if each.participant == WHO and each.role == "test" else each
        for each in honest
    ]
    assert rules_of(DESIGN, table) == [(WHO, "one_side", "26 of 26 on the left")]
    few = [each for each in table if each.participant != WHO or each.order < 10]
    assert ("one_side" in str(rules_of(DESIGN, few))) is False


def test_who_disagrees_with_themself_is_left_out(honest):
    strict = replace(DESIGN, exclusions=Exclusions(repeats_agree=0.5))
    rows, seen = [], set()
    for each in honest:
        if each.participant == WHO and each.role == "test":
            again = each.trial in seen
            one, other = each.trial.rsplit(".", 2)[1:]
            each = replace(each, answer=other if again else one)
            seen.add(each.trial)
        rows.append(each)
    assert (WHO, "repeats_agree", "0 of 2 alike") in rules_of(strict, rows)
    assert rules_of(DESIGN, rows) == []


def test_single_answers_leave_by_their_time(honest):
    design = replace(DESIGN, exclusions=Exclusions(seconds_min=0.5, seconds_max=100))
    table = changed(honest, WHO, "test", 3, seconds=0.2)
    table = changed(table, "simulated-00004", "test", 1, seconds=101.0)
    found = keep(design, table)
    assert (found.too_soon, found.too_late) == (3, 1)
    # A trial that was seen twice is judged by its second answer where the first has left.
    assert len(found.tests) + len(found.repeats) == 12 * 26 - 4


def test_a_rater_who_does_not_find_the_hidden_reference_is_screened():
    design = design_of("rating", scale="mushra", analysis=Analysis())
    table = crowd_answers(design, Crowd(people_sd=5, lapses=0), seats_of(design, 6), 1)
    assert rules_of(design, table) == []
    table = [
        replace(each, answer="80") if each.participant == WHO and each.left == "real" else each
        for each in table
    ]
    [(who, rule, found)] = rules_of(design, table)
    assert (who, rule) == (WHO, "post-screening") and found.startswith("hidden reference below 90")


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"left": "nobody"}, "condition 'nobody'; allowed: a condition of study.toml"),
        ({"answer": "nobody"}, "`answer`: 'nobody'; allowed:"),
        ({"right": ""}, "`right`: ''"),
        ({"kind": "rating", "answer": "7", "right": ""}, "`kind`: rating; allowed: binary"),
        ({"order": 2}, "with order 2 twice"),
    ],
)
def test_answers_that_the_study_cannot_have_are_refused(honest, values, told):
    table = changed(honest, WHO, "test", 1, **values)
    with pytest.raises(StudyError, match="answers row") as error:
        keep(DESIGN, table)
    assert told in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("answer", ["101", "-1", "nan", "inf", "good", "1e400"])
def test_a_rating_is_a_number_from_0_to_100(answer):
    design = design_of("rating")
    table = crowd_answers(design, Crowd(), seats_of(design, 2), 1)
    row = next(k for k, each in enumerate(table) if each.kind == "rating")
    table[row] = replace(table[row], answer=answer)
    with pytest.raises(StudyError, match=r"a number, 0 to 100"):
        keep(design, table)


def test_words_and_calls_that_were_not_offered_are_refused():
    for kind, answer in (("intelligibility", "dog"), ("sync", "bat")):
        design = design_of(kind)
        table = crowd_answers(design, Crowd(), seats_of(design, 2), 1)
        row = next(k for k, each in enumerate(table) if each.kind == kind)
        table[row] = replace(table[row], answer=answer)
        with pytest.raises(StudyError, match="`answer`"):
            keep(design, table)
