"""Known phones, by the rules and by `talkers`: whatever the rules seal and round, it does too."""

from __future__ import annotations

import ctypes.util
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import pytest

from elocute.animation import animate
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.evaluation.phone_mouth_scores import LABIODENTAL_MM, labiodental_gap, mouth_class
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.speech import SpokenText, speak
from elocute.speech.voices.settings import VoiceSettings

FPS = 60.0
MODELS = ("articulation", "talkers")
ROUNDED_SHARE = 0.9
TEXTS = {
    "en-us": "Who knew Bob's blue shoes would fit my five babies?",
    "de": "Süße Pflaumen und viel Butter mag mein Bruder Peter.",
    "fr": "Papa veut beaucoup de pommes et un peu de beurre.",
    "es": "El bombero subió al edificio y bajó a un bebé muy feliz.",
    "ru": "Мой брат Павел купил белую бумагу и пять больших яблок.",
    "cmn-latn-pinyin": "ba4 ba5 ming2 tian1 mai3 ba1 ge4 ping2 guo3 he2 pu2 tao5",
}


@pytest.fixture(scope="module")
def said(need: Callable[[object, str], None]) -> Callable[[str], SpokenText]:
    need(ctypes.util.find_library("espeak-ng"), "espeak-ng")
    return cache(lambda language: speak(TEXTS[language], VoiceSettings(language, "", 165, 50)))


@pytest.fixture(scope="module")
def moved(said: Callable[[str], SpokenText]) -> Callable[[str, str], Motion]:
    def motion(language: str, model: str) -> Motion:
        speech = said(language)
        return animate(
            speech.sound, phones=list(speech.phones), model=model, fps=FPS, life=0
        ).motion

    return cache(motion)


def nearest_mm(
    gap_mm: np.ndarray, phones: Sequence[tuple[float, float, str]], kind: str
) -> np.ndarray:
    """(phone,) the least gap during each phone of a kind, a frame around it included."""
    spans = [
        (round(start * FPS), round(end * FPS)) for start, end, p in phones if mouth_class(p) == kind
    ]
    return np.array([gap_mm[max(0, first - 1) : last + 2].min() for first, last in spans])


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("language", TEXTS)
def test_every_known_bilabial_is_sealed(said, moved, language: str, model: str) -> None:
    opening = measure_mouth(moved(language, model))["opening_mm"]
    found = nearest_mm(opening, said(language).phones, "bilabial")
    assert len(found) >= 5 and (found < CLOSED_MM).all()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("language", ["en-us", "de", "fr", "es"])
def test_every_known_labiodental_meets_the_teeth(said, moved, language: str, model: str) -> None:
    found = nearest_mm(
        labiodental_gap(moved(language, model)), said(language).phones, "labiodental"
    )
    assert len(found) and (found < LABIODENTAL_MM).all()


@pytest.mark.parametrize("language", TEXTS)
def test_known_rounded_vowels_are_as_round_as_the_rules_make_them(said, moved, language) -> None:
    head = load_builtin_head()
    rest = measure_mouth(Motion(head, np.zeros((1, len(head.expression_names)), np.float32), FPS))

    def rounding_mm(model: str) -> np.ndarray:
        measures = measure_mouth(moved(language, model))
        frames = [
            round((start + end) / 2 * FPS)
            for start, end, phone in said(language).phones
            if mouth_class(phone) == "rounded"
        ]
        assert len(frames) >= 2
        narrower = rest["width_mm"][0] - measures["width_mm"][frames]
        further = measures["protrusion_mm"][frames] - rest["protrusion_mm"][0]
        return np.array([narrower.mean(), further.mean()])

    assert (rounding_mm("talkers") >= ROUNDED_SHARE * rounding_mm("articulation")).all()


@pytest.mark.parametrize("model", MODELS)
def test_a_text_beside_a_recording_seals_what_it_says(said, model: str) -> None:
    """The phones of a text are found in the sound, and known from then on."""
    speech = said("en-us")
    take = animate(speech.sound, text=TEXTS["en-us"], model=model, fps=FPS, life=0)
    assert take.notes == ()
    opening = measure_mouth(take.motion)["opening_mm"]
    near = [(start - 0.03, end + 0.03, phone) for start, end, phone in speech.phones]
    assert (nearest_mm(opening, near, "bilabial") < CLOSED_MM).all()
