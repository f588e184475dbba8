"""Perceptual studies: what people see in faces that speak, from a file to a table for a paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.study.crowd import (
        Crowd as Crowd,
        crowd_answers as crowd_answers,
        seats_of as seats_of,
    )
    from elocute.study.design.design import Design as Design
    from elocute.study.design.design_file import read_design as read_design
    from elocute.study.design.plan_settings import Plan as Plan
    from elocute.study.design.power import plan_for as plan_for, plan_study as plan_study
    from elocute.study.report.answers import (
        Answer as Answer,
        read_answers as read_answers,
        write_answers as write_answers,
    )
    from elocute.study.report.report import make_report as make_report
    from elocute.study.report.report_files import write_report as write_report

__getattr__, __dir__ = lazy(__name__, __file__)
