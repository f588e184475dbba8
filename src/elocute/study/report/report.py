"""The report of a study: its design and its table of answers, and nothing else, to sections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from elocute.errors import StudyError, printable
from elocute.study.design.design import Design
from elocute.study.report.answers import Answer
from elocute.study.report.exclusions import ONE_SIDE_MIN, Kept, keep
from elocute.study.report.report_parts import Cell, Report, Section, Table
from elocute.study.statistics.agreement import alpha_interval
from elocute.study.statistics.learning import learning_section
from elocute.study.statistics.preferences import preference_section, style_section
from elocute.study.statistics.proportions import wilson_interval
from elocute.study.statistics.ratings import rating_section
from elocute.study.statistics.sync_curves import sync_section
from elocute.study.statistics.word_scores import word_section

SECTIONS = {
    "binary": preference_section,
    "style": style_section,
    "rating": rating_section,
    "intelligibility": word_section,
    "sync": sync_section,
}
"""What is found, by what was asked."""
ASKED = {
    "binary": "which of two moves more naturally and in accordance with the sound",
    "style": "which of two speaks in the manner of a reference",
    "rating": "how good it is",
    "intelligibility": "which word is said",
    "sync": "whether the sound is early, together with the picture or late",
}
EXCLUDED_MAX = 500
"""People that are named one by one."""
NOT_PEOPLE = (
    "These answers were simulated. No person saw this study, and nothing here is evidence of what "
    "people see."
)


def make_report(
    design: Design,
    answers: Sequence[Answer],
    *,
    served_sha256: str = "",
    answers_sha256: str = "",
    simulated: bool = False,
) -> Report:
    """Report a study.

    Parameters
    ----------
    design : Design
        The study, with its sounds by name where they are known.
    answers : sequence of Answer
        Its table.
    served_sha256 : str
        SHA-256 of the study.toml that was rendered and served; "" where it is not known.
    answers_sha256 : str
        SHA-256 of the table's file; "" where it has none.
    simulated : bool
        Whether the answers are known to be simulated, which every page then says.

    Returns
    -------
    Report

    Raises
    ------
    StudyError
        For a table without test answers, and for answers that this study cannot have been given.
    MachineError
        Where a package of the extra `study` is missing.
    """
    kept = keep(design, answers)
    if not any(each.role == "test" for each in answers):
        raise StudyError.about("answers", found="no test answers", allowed="one or more")
    simulated = simulated or any(each.participant.startswith("simulated-") for each in answers)
    sections = [_exclusion_section(design, answers, kept)]
    if kept.tests:
        sections = [
            SECTIONS[design.study.kind](design, kept.tests),
            _agreement_section(design, kept),
            learning_section(design, kept),
            *sections,
        ]
    report = Report(printable(design.study.title), _facts(design, answers, kept), sections)
    report.facts.extend(_sources(design, served_sha256, answers_sha256))
    report.warnings.extend(_warnings(design, kept, served_sha256, simulated))
    return report


def _facts(design: Design, answers: Sequence[Answer], kept: Kept) -> list[tuple[str, str]]:
    people = len(kept.people)
    left = people - len(kept.excluded)
    question = design.study.question
    asked = question.get("") or question.get("en") or ASKED[design.study.kind]
    times = sorted(each.answered_at for each in answers)
    return [
        ("asked", printable(asked)),
        ("people", f"{left} of {people}; {len(kept.excluded)} left out by the rules of the study"),
        ("answers", f"{len(kept.tests)} judged, of {len(answers)} in the table"),
        ("conditions", ", ".join(each.name for each in design.judged)),
        ("answered", f"{times[0][:10]} to {times[-1][:10]}"),
        ("confidence", f"{100 * design.analysis.confidence:g} %"),
    ]


def _sources(design: Design, served: str, answers: str) -> list[tuple[str, str]]:
    return [
        ("study analysed (SHA-256)", design.sha256 or "none: made in Python"),
        ("study served (SHA-256)", served or "not known"),
        ("answers (SHA-256)", answers or "none: made in Python"),
    ]


def _warnings(design: Design, kept: Kept, served: str, simulated: bool) -> list[str]:
    warnings = [NOT_PEOPLE] if simulated else []
    if served and served != design.sha256:
        warnings.append(
            "The study that is analysed is not the one that was served: its rules may have been "
            "changed after answers were given."
        )
    if not kept.tests:
        warnings.append("The rules of the study leave out every answer; nothing can be told.")
    left = len(kept.people) - len(kept.excluded)
    if kept.tests and left < 12:
        warnings.append(f"Only {left} people are left; intervals over people are rough.")
    return warnings


def _exclusion_section(design: Design, answers: Sequence[Answer], kept: Kept) -> Section:
    counts = Counter(each.rule for each in kept.excluded)
    limits = {name: f"{value:g}" for name, value in asdict(design.exclusions).items()}
    limits["qualification"] = (
        f"{design.qualification.needed} of {design.qualification.items} right"
        if design.exclusions.qualification
        else "off"
    )
    rows: list[list[Cell]] = [
        [name, limit, counts.get(name, 0)]
        for name, limit in limits.items()
        if not name.startswith("seconds")
    ]
    if counts.get("post-screening") or design.study.scale == "mushra":
        rows.append(["post-screening", "BS.1534-3", counts.get("post-screening", 0)])
    answered: list[list[Cell]] = [
        ["seconds_min", limits["seconds_min"], kept.too_soon],
        ["seconds_max", limits["seconds_max"], kept.too_late],
    ]
    named: list[list[Cell]] = [
        [each.participant, each.rule, each.found, each.answers] for each in kept.excluded
    ]
    obvious = Counter((each.role, each.answer == each.correct) for each in kept.obvious)
    checks: list[list[Cell]] = [
        [role, obvious[role, True] + obvious[role, False], share]
        for role in ("qualification", "catch")
        for share in [
            wilson_interval(
                obvious[role, True],
                obvious[role, True] + obvious[role, False],
                design.analysis.confidence,
            )
        ]
    ]
    text = (
        "The rules stand in study.toml, which was fixed before the first answer. People are left "
        "out by the first rule that they break; keeping to one side counts from "
        f"{ONE_SIDE_MIN} answers on."
    )
    roles = Counter(each.role for each in answers)
    text += (
        " The table holds " + ", ".join(f"{n} {role} answers" for role, n in roles.items()) + "."
    )
    tables = [
        Table("exclusion_rules", "People left out", ("rule", "limit", "people"), rows),
        Table("answer_rules", "Single answers left out", ("rule", "limit, s", "answers"), answered),
        Table(
            "obvious",
            "Items with an obvious answer, of those who stay",
            ("items", "answers", "right, %"),
            checks,
        ),
    ]
    if named:
        tables.append(
            Table(
                "excluded",
                "Who was left out, and why",
                ("participant", "rule", "found", "test answers"),
                named[:EXCLUDED_MAX],
            )
        )
    return Section("Exclusions", [text], [], tables)


def _agreement_section(design: Design, kept: Kept) -> Section:
    rating = design.study.kind == "rating"
    level = "interval" if rating else "nominal"
    values = [float(each.answer) if rating else each.answer for each in kept.tests]
    alpha = alpha_interval(
        [each.trial for each in kept.tests], np.array(values), level, design.analysis.confidence
    )
    counts = Counter(each.trial for each in kept.tests)
    rows: list[list[Cell]] = [[level, len(counts), float(np.mean(list(counts.values()))), alpha]]
    text = (
        "Krippendorff's alpha over trials: 1 where all agree, 0 where they agree as by chance. "
        "Where a preference is near a half, people disagree by its nature, and alpha is low."
    )
    table = Table(
        "agreement",
        "Agreement between people",
        ("answers are", "trials", "answers for each", "alpha"),
        rows,
        "Its interval is by the bootstrap over trials.",
    )
    return Section("Agreement", [text], [], [table])
