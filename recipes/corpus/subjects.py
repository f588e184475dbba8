"""The twelve subjects: a face of the head's space, a style, a voice, a tempo."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Subject:
    """style is a name of `elocute.articulation.style.STYLES`; the subject is called by it.

    engine and voice name a synthesiser's voice; tempo 1 is its own.
    """

    style: str
    sex: str
    identity: int
    engine: str
    voice: str
    tempo: float = 1.0
    pitch: int = 50


SUBJECTS: tuple[Subject, ...] = (
    Subject("plain", "female", 101, "flite", "slt"),
    Subject("calm", "male", 102, "flite", "rms", 0.92),
    Subject("broad", "male", 103, "festival", "ked_diphone"),
    Subject("mumble", "male", 104, "flite", "awb", 1.1),
    Subject("crisp", "female", 105, "espeak", "en-us+Alicia", 1.0, 60),
    Subject("rounded", "female", 106, "festival", "cmu_us_slt_arctic_hts", 0.95),
    Subject("smiling", "female", 107, "espeak", "en-gb-x-rp+anika", 1.05, 58),
    Subject("wry", "male", 108, "flite", "kal16"),
    Subject("tense", "female", 109, "espeak", "en-gb-scotland+belinda", 1.12, 52),
    Subject("drawl", "male", 110, "espeak", "en-us+Mike", 0.85, 40),
    Subject("pouting", "female", 111, "espeak", "en-029+shelby", 1.0, 55),
    Subject("lopsided", "male", 112, "espeak", "en+edward2", 1.0, 42),
)
VALIDATION = ("tense", "drawl")
TEST = ("pouting", "lopsided")
