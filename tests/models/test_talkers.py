"""The model of many talkers: `--model talkers`."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import elocute
from benchmarks.noises import noises, opening_mm
from elocute.animation import animate
from elocute.articulation.style import STYLES, Style
from elocute.audio.read import read_audio
from elocute.head.builtin import load_builtin_head
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.models import talkers
from elocute.models.registry import open_model
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from recipes.voice.made_sounds import laughter, levelled, song

LIPS_CLOSE_S = {"me": 1.69, "p": 5.46, "m": 6.34, "blue": 8.18}  # as recipes/example.py says
WAITS_S = 0.55  # of the example, before its first sound
RATE = 16000
CUT = round(2.9 * RATE)  # within a word


@pytest.fixture(scope="module")
def mouth(speech_wav):
    """Measures of the example as the model says it, in a style and with contacts or without."""

    @cache
    def measured(style="plain", contacts="auto", **options):
        take = animate(
            speech_wav, model="talkers", style=style, contacts=contacts, life=0, **options
        )
        return measure_mouth(take.motion)

    return measured


def test_it_names_what_it_is() -> None:
    model = open_model("talkers")
    assert model.styles == tuple(STYLES) and model.makes_contacts
    note = talkers.TalkersModel().network.record["note"]
    assert "Arabic" in note and "GRID" in note and "Whisper" in note


def test_it_speaks_rests_and_moves_much_as_the_rules_do(mouth, speech_wav) -> None:
    opening = mouth()["opening_mm"]
    assert np.percentile(opening, 90) > 4
    assert opening[:6].max() < 0.1 and opening[-10:].max() < 0.1
    rules = measure_mouth(animate(speech_wav, model="articulation", life=0).motion)["opening_mm"]
    assert 0.6 < np.corrcoef(opening, rules)[0, 1] < 0.99


@pytest.mark.parametrize("word", LIPS_CLOSE_S)
def test_its_lips_meet(mouth, word) -> None:
    frame = round(LIPS_CLOSE_S[word] * 60)
    assert mouth()["opening_mm"][frame - 8 : frame + 9].min() == 0


def test_lips_in_speech_seal_only_where_a_contact_is_decoded(mouth) -> None:
    bare = mouth(contacts="off")["opening_mm"]
    assert bare.min() > 0.9 * talkers.NEARLY_MM


def test_nothing_moves_in_boxes(mouth) -> None:
    """An opening goes from shut to half of the most in no less than two frames."""
    opening = mouth()["opening_mm"]
    assert np.abs(np.diff(opening)).max() < 0.4 * opening.max()


@pytest.mark.parametrize("name", sorted(noises(0.1)))
def test_what_is_no_voice_leaves_the_mouth_shut(name) -> None:
    assert opening_mm(noises(3.0)[name], "talkers") < 1.0


@pytest.mark.parametrize("make", [song, laughter])
def test_a_song_and_laughter_move_it(make) -> None:
    draw = np.random.default_rng(2026)
    assert min(opening_mm(levelled(make(draw)), "talkers") for _ in range(2)) > 2


def test_known_speech_begins_and_ends_at_rest_and_opens_before_it_sounds() -> None:
    said = [(0.6, 0.8, "AA"), (0.8, 0.9, "B"), (0.9, 1.3, "AA")]
    take = elocute.animate(
        np.zeros(round(1.42 * RATE), np.float32), rate=RATE, model="talkers", phones=said, life=0
    )
    opening = measure_mouth(take.motion)["opening_mm"]
    assert opening[0] < 0.1 and opening[-1] < 0.1
    assert opening[round(0.38 * 60)] > 2.5  # a breath


def test_lips_part_before_the_first_sound_only_as_far_as_was_heard(mouth) -> None:
    opening, heard = mouth()["opening_mm"], mouth(contacts="off")["opening_mm"]
    waiting = slice(0, round(WAITS_S * 60))
    assert (opening - heard)[waiting].max() < 0.3
    assert opening[waiting].max() < 4.5


def test_a_pause_under_four_tenths_of_a_second_stays_parted(speech_wav) -> None:
    sound = read_audio(speech_wav, sample_rate=RATE).samples
    least = {}
    for pause_s in (0.2, 1.5):
        quiet = np.zeros(round(pause_s * RATE), np.float32)
        words = np.concatenate([sound[:CUT], quiet, sound[CUT : CUT + 2 * RATE]])
        opening = measure_mouth(animate(words, rate=RATE, model="talkers", life=0).motion)[
            "opening_mm"
        ]
        middle = round((CUT / RATE + pause_s / 2) * 60)
        least[pause_s] = opening[middle - 3 : middle + 3].max()
    assert least[1.5] < 0.1 < 0.5 < least[0.2]


def test_styles_set_amplitude_tempo_and_rest(mouth) -> None:
    def spread(style) -> float:
        return float(np.percentile(mouth(style)["opening_mm"], 95))

    assert spread("mumble") < 0.8 * spread("plain") < 0.96 * spread("broad")
    speed = {s: np.abs(np.diff(mouth(s)["opening_mm"])).mean() for s in ("drawl", "crisp")}
    assert speed["crisp"] > 1.3 * speed["drawl"]
    parted = Style(parted_mm=2.0)
    assert mouth(parted)["opening_mm"][:6] == pytest.approx(2.0, abs=0.1)


def test_a_smile_is_worn_in_speech_and_at_rest_and_seals_stay(speech_wav, mouth) -> None:
    smiling = animate(speech_wav, model="talkers", style="smiling", life=0).curves
    wry = animate(speech_wav, model="talkers", style="wry", life=0).curves
    assert smiling["mouthSmileLeft"].min() >= 0.4 and smiling["cheekSquintRight"].min() > 0.2
    assert wry["mouthSmileRight"].min() > 0.1 > wry["mouthSmileLeft"][0]
    wider = mouth("smiling")["width_mm"] - mouth()["width_mm"]
    assert wider[:6].min() > 3
    frame = round(LIPS_CLOSE_S["p"] * 60)
    assert mouth("smiling")["opening_mm"][frame - 8 : frame + 9].min() < 0.3


def test_known_phones_move_it() -> None:
    quiet = (np.random.default_rng(0).normal(size=2 * RATE) * 0.05).astype(np.float32)
    said = [(0.5, 0.8, "AA"), (0.8, 0.9, "B"), (0.9, 1.3, "AA"), (1.3, 1.6, "IY")]
    take = elocute.animate(quiet, rate=RATE, model="talkers", phones=said, life=0)
    opening = measure_mouth(take.motion)["opening_mm"]
    assert opening[round(0.7 * 60)] > 2 and opening[round(0.85 * 60)] < 0.3
    assert take.notes == ()


def test_no_strength_is_no_movement(mouth) -> None:
    """But for contacts: the lower lip still meets the teeth, and opens no further than in f."""
    head = load_builtin_head()
    bite = Motion(head, head.expression_vector(VISEME_SHAPES["FF"])[None], 1.0)
    bitten_mm = measure_mouth(bite)["opening_mm"][0]
    assert mouth(strength=0.0)["opening_mm"].max() < bitten_mm + 0.1
