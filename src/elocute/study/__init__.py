"""Perceptual studies: what people see in faces that speak, from a file to a table for a paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.study.answers import Answer, read_answers, write_answers
    from elocute.study.crowd import crowd_answers, seats_of
    from elocute.study.crowd_settings import Crowd
    from elocute.study.design import Design
    from elocute.study.design_file import read_design
    from elocute.study.plan_settings import Plan
    from elocute.study.power import plan_for, plan_study
    from elocute.study.raters import Raters, Weights, watch_study
    from elocute.study.report import make_report
    from elocute.study.report_files import write_report

__all__ = [
    "Answer",
    "Crowd",
    "Design",
    "Plan",
    "Raters",
    "Weights",
    "crowd_answers",
    "make_report",
    "plan_for",
    "plan_study",
    "read_answers",
    "read_design",
    "seats_of",
    "watch_study",
    "write_answers",
    "write_report",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "answers": ("Answer", "read_answers", "write_answers"),
        "crowd": ("crowd_answers", "seats_of"),
        "crowd_settings": ("Crowd",),
        "design": ("Design",),
        "design_file": ("read_design",),
        "plan_settings": ("Plan",),
        "power": ("plan_for", "plan_study"),
        "raters": ("Raters", "Weights", "watch_study"),
        "report": ("make_report",),
        "report_files": ("write_report",),
    },
)
