"""Whether reports of studies recover what simulated crowds were given.

    python -m benchmarks.study_crowd                       # 1,000 studies of each crowd
    python -m benchmarks.study_crowd --simulations 100 --only preferences
    python -m benchmarks.study_crowd --report report/      # a report of one of them

The picture of the docs is the top of that report, as Chromium shows it at 1120 by 1500 pixels.

A study's report is made as people make it: exclusions first, then every interval. An interval holds
the truth where the share, the mean or the bound that the crowd was given lies in it. Prints
Markdown.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.study.crowd import (
    SYNC_BOUNDS_MS,
    Crowd,
    Seat,
    crowd_answers,
    seats_of,
)
from elocute.study.design.design import (
    Analysis,
    Assignment,
    Comparisons,
    Condition,
    Design,
    Exclusions,
    Stimuli,
    StimulusSound,
    Study,
)
from elocute.study.design.power import Plan, power_with
from elocute.study.report.answers import Answer
from elocute.study.report.exclusions import keep
from elocute.study.report.report import make_report
from elocute.study.report.report_files import write_report
from elocute.study.statistics.bradley_terry import fit_bradley_terry
from elocute.study.statistics.mixed_logit import fit_mixed_logit, marginal_share
from elocute.study.statistics.preferences import mixed_share, pair_results
from elocute.study.statistics.proportions import wilson_interval
from elocute.study.statistics.ratings import _mean, _value
from elocute.study.statistics.sync_curves import _bounds, _counts, fit_sync_curve
from elocute.study.statistics.two_way import mean_over

NAMES = ("rules", "voca", "talkers")
LEVELS = {"rules": 0.0, "voca": -0.5, "talkers": 0.7}
PEOPLE, SOUNDS = 60, 12
WORDS = ("bat", "mat", "pat", "cat")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--simulations", type=int, default=1000)
    parser.add_argument("--only", choices=sorted(PARTS), help="one part")
    parser.add_argument("--report", type=Path, help="write a report of one crowd, and no more")
    given = parser.parse_args()
    if given.report:
        write_report(example_report(), given.report, overwrite=True)
        return
    for name in [given.only] if given.only else PARTS:
        began = time.perf_counter()
        PARTS[name](given.simulations)
        print(f"\n({name}: {time.perf_counter() - began:.0f} s)\n", flush=True)


def study(kind: str = "binary", **more: object) -> Design:
    """Three conditions with twelve sentences, all pairs by everybody, a catch trial in ten."""
    sounds = tuple(
        StimulusSound(f"s{k:02}", f"s{k:02}.wav", word=WORDS[k % 4], choices=WORDS)
        for k in range(SOUNDS)
    )
    made = {
        "study": Study("Which face speaks more naturally?", kind, "ada@example.org"),
        "conditions": tuple(Condition(name, model=name) for name in NAMES),
        "stimuli": Stimuli(sounds),
        "assignment": Assignment(repeats=3),
        "exclusions": Exclusions(),
        "analysis": Analysis(baseline="rules"),
    }
    return Design(**{**made, **more})  # type: ignore[arg-type]


CROWDS = {
    "people and stimuli differ": Crowd(LEVELS, side=0.2, cheaters=0.15),
    "nobody differs": Crowd(LEVELS, people_sd=0, stimuli_sd=0, side=0.2, cheaters=0.15),
    "they differ much": Crowd(LEVELS, people_sd=1.5, stimuli_sd=0.8, side=0.2, cheaters=0.15),
    "no preferences": Crowd({}, side=0.2, cheaters=0.15),
}


class Coverage:
    """How often intervals hold the truth, and how wide they are."""

    def __init__(self) -> None:
        self._held: dict[str, list[bool]] = defaultdict(list)
        self._wide: dict[str, list[float]] = defaultdict(list)

    def add(self, name: str, found: ConfidenceInterval, truth: float) -> None:
        if found.low != found.low:
            return
        self._held[name].append(found.low <= truth <= found.high)
        self._wide[name].append(found.high - found.low)

    def rows(self, unit: float = 1.0) -> Iterator[str]:
        for name, held in self._held.items():
            share = wilson_interval(sum(held), len(held), 0.95)
            width = unit * float(np.mean(self._wide[name]))
            yield (
                f"{name} | {len(held)} | {100 * share.value:.1f} "
                f"({100 * share.low:.1f}–{100 * share.high:.1f}) | {width:.3g}"
            )


def preferences(simulations: int) -> None:
    """Shares, strengths, false findings, and who is left out."""
    design = study()
    seats = seats_of(design, PEOPLE)
    print("| crowd | interval | intervals | hold the truth, % | mean width, points |")
    print("|---|---|---|---|---|")
    notes = []
    for title, crowd in CROWDS.items():
        coverage, found = Coverage(), defaultdict(list)
        # The first crowd is the one to be recovered; the others say when.
        count = simulations if crowd is next(iter(CROWDS.values())) else simulations // 4
        for seed in range(count):
            _one_preference(design, crowd, seats, seed, coverage, found)
        for row in coverage.rows(100):
            print(f"| {title} | {row} |", flush=True)
        notes.append((title, found))
    print("\n| crowd | p < 0.05 exact, % | mixed, % | cheaters left out, % | others left out, % |")
    print("|---|---|---|---|---|")
    for title, found in notes:
        numbers = [100 * float(np.mean(found[name])) for name in ("exact", "mixed", "caught")]
        lost = 100 * float(np.mean(found["lost"]))
        print(f"| {title} | " + " | ".join(f"{n:.1f}" for n in numbers) + f" | {lost:.1f} |")


def _one_preference(
    design: Design,
    crowd: Crowd,
    seats: list[Seat],
    seed: int,
    coverage: Coverage,
    found: dict[str, list[float]],
) -> None:
    answers = crowd_answers(design, crowd, seats, seed)
    kept = keep(design, answers)
    gone = {each.participant for each in kept.excluded}
    cheating = np.random.default_rng(seed).permutation(len(seats)) < round(
        crowd.cheaters * len(seats)
    )
    for number, cheats in enumerate(cheating.tolist(), 1):
        found["caught" if cheats else "lost"].append(f"simulated-{number:05}" in gone)
    for each in pair_results(design, kept.tests):
        truth = crowd.true_share(each.first, each.second)
        coverage.add("all answers (Wilson)", each.wilson, truth)
        coverage.add("mixed model", each.mixed.share, truth)
        of_pair = [a for a in kept.tests if {a.left, a.right} == {each.first, each.second}]
        both, _ = mean_over(
            [float(a.answer == each.first) for a in of_pair],
            [a.participant for a in of_pair],
            [a.stimulus for a in of_pair],
            0.95,
        )
        coverage.add("two-way clustering", both, truth)
        found["exact"].append(each.p < 0.05)
        found["mixed"].append(each.mixed.p < 0.05)
    strengths = _strengths(kept.tests)
    for name in ("voca", "talkers"):
        share = crowd.true_share(name, "rules")
        apart = strengths.interval(name, 0.95, "rules")
        shares = [1 / (1 + np.exp(-v)) for v in (apart.value, apart.low, apart.high)]
        coverage.add("Bradley–Terry, as shares", ConfidenceInterval(*shares), share)


def _strengths(tests: list[Answer]):
    found = fit_bradley_terry(
        [each.left for each in tests],
        [each.right for each in tests],
        [each.answer == each.left for each in tests],
        [each.participant for each in tests],
        [each.stimulus for each in tests],
    )
    assert found is not None
    return found


def cheaters(simulations: int) -> None:
    """The same crowd where nobody is left out: what exclusions are for."""
    rules = Exclusions(qualification=False, catches_missed=1000, answered=0.0, one_side=1.0)
    design = study(exclusions=rules)
    design = replace(design, qualification=replace(design.qualification, failed="mark"))
    crowd = CROWDS["people and stimuli differ"]
    seats = seats_of(design, PEOPLE)
    coverage = Coverage()
    for seed in range(simulations):
        tests = keep(design, crowd_answers(design, crowd, seats, seed)).tests
        for each in pair_results(design, tests):
            truth = crowd.true_share(each.first, each.second)
            coverage.add("all answers (Wilson)", each.wilson, truth)
            coverage.add("mixed model", each.mixed.share, truth)
    print("| nobody left out, interval | intervals | hold the truth, % | mean width, points |")
    print("|---|---|---|---|")
    for row in coverage.rows(100):
        print(f"| {row} |")


def ratings(simulations: int) -> None:
    """Means of ratings by MUSHRA."""
    levels = {"rules": 50.0, "voca": 40.0, "talkers": 60.0}
    crowd = Crowd(levels, people_sd=8, stimuli_sd=5, noise=8, lapses=0, cheaters=0.1)
    design = study(
        "rating",
        study=Study("How natural?", "rating", "ada@example.org", scale="mushra"),
        conditions=(*study().conditions, Condition("real", videos="real")),
        comparisons=Comparisons(reference="real"),
    )
    seats = seats_of(design, 30)
    coverage = Coverage()
    for seed in range(simulations):
        tests = keep(design, crowd_answers(design, crowd, seats, seed)).tests
        for name, level in levels.items():
            of_it = [each for each in tests if each.left == name]
            mean, _ = _mean([_value(each, False) for each in of_it], of_it, 0.95)
            coverage.add("mean rating", mean, level)
    print("| interval | intervals | hold the truth, % | mean width, points of 100 |")
    print("|---|---|---|---|")
    for row in coverage.rows():
        print(f"| {row} |")


def words(simulations: int) -> None:
    """Shares of words understood, by the mixed model and of all answers."""
    levels = {"rules": 0.5, "voca": -0.3, "talkers": 1.0}
    crowd = Crowd(levels, cheaters=0.1, lapses=0)
    design = study("intelligibility")
    seats = seats_of(design, 40)
    coverage = Coverage()
    for seed in range(simulations):
        tests = keep(design, crowd_answers(design, crowd, seats, seed)).tests
        for name, level in levels.items():
            of_it = [each for each in tests if each.left == name]
            yes = [each.answer == each.correct for each in of_it]
            truth = marginal_share(level, float(np.hypot(crowd.people_sd, crowd.stimuli_sd)))
            coverage.add("all answers (Wilson)", wilson_interval(sum(yes), len(yes), 0.95), truth)
            coverage.add("mixed model", mixed_share(yes, of_it, 0.95).share, truth)
    print("| interval | intervals | hold the truth, % | mean width, points |")
    print("|---|---|---|---|")
    for row in coverage.rows(100):
        print(f"| {row} |")


def sync(simulations: int) -> None:
    """Bounds of what is felt as together."""
    offsets = (-400.0, -250.0, -150.0, -50.0, 0.0, 50.0, 150.0, 250.0, 400.0)
    conditions = tuple(
        Condition(f"c{k}", model="rules", offset_ms=offset) for k, offset in enumerate(offsets)
    )
    design = study("sync", conditions=conditions, analysis=Analysis())
    crowd = Crowd(cheaters=0.1, lapses=0.02)
    seats = seats_of(design, 30)
    offset_of = {each.name: each.offset_ms for each in conditions}
    early, late = SYNC_BOUNDS_MS
    truth = {"middle": (early + late) / 2, "early": early, "late": late}
    coverage = Coverage()
    for seed in range(simulations):
        tests = keep(design, crowd_answers(design, crowd, seats, seed)).tests
        counts = _counts(tests, offset_of, np.array(offsets))
        fitted = fit_sync_curve(np.array(offsets), counts.sum(axis=0))
        found = _bounds(np.array(offsets), counts, fitted, 0.95)
        for name, interval in zip(("middle", "early", "late"), found, strict=False):
            assert isinstance(interval, ConfidenceInterval)
            coverage.add(name, interval, truth[name])
    print("| bound | intervals | hold the truth, % | mean width, ms |")
    print("|---|---|---|---|")
    for row in coverage.rows():
        print(f"| {row} |")


def library(simulations: int) -> None:
    """The mixed model against that of statsmodels, whose fit is variational; a fifth as many."""
    from statsmodels.genmod.bayes_mixed_glm import BinomialBayesMixedGLM

    print("| people, stimuli | they differ by, logits | Laplace, % | statsmodels, % |")
    print("|---|---|---|---|")
    for people, stimuli, by_people, by_stimuli in (
        (60, 12, 0.8, 0.5),
        (60, 12, 0.8, 0.0),
        (20, 20, 0.5, 0.5),
        (100, 10, 1.0, 0.3),
    ):
        held = np.zeros(2)
        count = max(simulations // 5, 1)
        rng = np.random.default_rng(0)
        who, what = np.divmod(np.arange(people * stimuli), stimuli)
        members = np.concatenate([np.eye(people)[who], np.eye(stimuli)[what]], axis=1)
        groups = np.repeat([0, 1], [people, stimuli])
        fixed = np.ones((len(who), 1))
        for _ in range(count):
            logit = 0.7 + by_people * rng.standard_normal(people)[who]
            logit = logit + by_stimuli * rng.standard_normal(stimuli)[what]
            yes = (rng.random(len(who)) < 1 / (1 + np.exp(-logit))).astype(float)
            low, high = fit_mixed_logit(yes, fixed, {"who": who, "what": what}).interval(0, 0.95)
            held[0] += low <= 0.7 <= high
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                model = BinomialBayesMixedGLM(yes, fixed, members, groups, vcp_p=1, fe_p=2)
                theirs = model.fit_vb()
            held[1] += abs(theirs.fe_mean[0] - 0.7) < 1.96 * theirs.fe_sd[0]
        ours, their = 100 * held / count
        print(
            f"| {people}, {stimuli} | {by_people:g}, {by_stimuli:g} | {ours:.1f} | {their:.1f} |",
            flush=True,
        )


def planning(simulations: int) -> None:
    """Power that a plan promises against how often reports of such studies find it."""
    print("| people | preference, % | plan says, % | the report's mixed model finds, % |")
    print("|---|---|---|---|")
    count = max(simulations // 5, 1)
    for people, share in ((24, 0.6), (48, 0.6), (24, 0.65), (48, 0.5)):
        plan = Plan(share=share, trials=20, stimuli=20, simulations=max(simulations, 100))
        said = power_with(plan, people).power.value
        rng = np.random.default_rng(1)
        who, what = np.divmod(np.arange(people * 20), 20)
        sd = float(np.hypot(plan.people_sd, plan.stimuli_sd))
        low, high = -5.0, 5.0
        for _ in range(50):
            middle = (low + high) / 2
            low, high = (middle, high) if marginal_share(middle, sd) < share else (low, middle)
        found = 0
        for _ in range(count):
            logit = low + plan.people_sd * rng.standard_normal(people)[who]
            logit = logit + plan.stimuli_sd * rng.standard_normal(20)[what]
            p = (1 - plan.lapses) / (1 + np.exp(-logit)) + plan.lapses / 2
            yes = (rng.random(len(p)) < p).astype(float)
            fitted = fit_mixed_logit(yes, np.ones((len(p), 1)), {"who": who, "what": what})
            found += fitted.p_value(0) < 0.05
        print(f"| {people} | {100 * share:g} | {100 * said:.1f} | {100 * found / count:.1f} |")


def example_report():
    """Of one crowd, for the picture in the docs."""
    design = study()
    answers = crowd_answers(
        design, CROWDS["people and stimuli differ"], seats_of(design, PEOPLE), 7
    )
    return make_report(design, answers)


PARTS: dict[str, Callable[[int], None]] = {
    "preferences": preferences,
    "cheaters": cheaters,
    "ratings": ratings,
    "words": words,
    "sync": sync,
    "library": library,
    "planning": planning,
}

if __name__ == "__main__":
    main()
