"""Designs that tests of reports share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

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

WORDS = ("bat", "mat", "pat", "cat")


def design_of(kind: str = "binary", *, sounds: int = 8, scale: str = "mos", **more: Any) -> Design:
    """A small study of a kind: three conditions, or five offsets."""
    conditions = tuple(Condition(name, model=name) for name in ("rules", "voca", "talkers"))
    spoken = tuple(
        StimulusSound(f"s{k}", f"s{k}.wav", word=WORDS[k % 4], choices=WORDS) for k in range(sounds)
    )
    made: dict[str, Any] = {
        "study": Study("Three ways to speak", kind, "ada@example.org", scale=scale),
        "conditions": conditions,
        "stimuli": Stimuli(spoken),
        "assignment": Assignment(repeats=2),
        "exclusions": Exclusions(),
        "analysis": Analysis(baseline="rules"),
    }
    if kind == "style":
        shown = tuple(
            Condition(f"ref-{each.name}", model=each.name, style="s1", reference_for=each.name)
            for each in conditions
        )
        made |= {"conditions": conditions + shown}
    if kind == "rating" and scale == "mushra":
        made |= {
            "conditions": (*conditions, Condition("real", videos="real"), _anchor()),
            "comparisons": Comparisons(reference="real"),
        }
    if kind == "sync":
        made |= {
            "conditions": tuple(
                Condition(f"by{offset:.0f}".replace("-", "m"), model="rules", offset_ms=offset)
                for offset in (-400.0, -200.0, -100.0, 0.0, 100.0, 200.0, 400.0)
            ),
            "analysis": Analysis(),
        }
    return Design(**{**made, **more})


def _anchor() -> Condition:
    return replace(Condition("still", model="rules"), still=True)
