"""`recipes.train_talkers` on talkers whose mouths are known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra `train`")

from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.audio.write import write_flac
from elocute.errors import ModelError
from elocute.models.registry import open_model
from elocute.models.talker_inputs import RULES_COLUMN, RULES_MIDDLE_MM, RULES_UNIT_MM
from elocute.motion.mouth_measures import measure_mouth
from recipes.talkers.clips import Clip, read_clips, standardise
from recipes.talkers.fit import FitSettings, fit
from recipes.talkers.selection import (
    calibrate,
    correlations,
    split_sentences,
    split_talkers,
)
from recipes.train_talkers import middle_of_rules_mm, write_model

EYES_MM = 90.0
SHORT = FitSettings(channels=16, epochs=3, steps=8, batch=4, rows=100, warm_up=4)


@pytest.fixture(scope="module")
def clips(speech_wav: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Clip]:
    """Five talkers who open twice as far as the rules do, and say so 0.1 s too late."""
    folder = tmp_path_factory.mktemp("talkers")
    (folder / "clips").mkdir()
    sound = read_audio(speech_wav, sample_rate=16000)
    records = []
    for place in range(5):
        samples = sound.samples[place * 8000 : place * 8000 + 40000]
        name = f"clip{place}"
        write_flac(folder / "clips" / f"{name}.flac", samples, 16000)
        part = type(sound)(samples, 16000)
        rules = animate(part, contacts="off", fps=25, model="articulation")
        mouth = measure_mouth(rules.motion)
        opening = 2 * mouth["opening_mm"] / EYES_MM
        np.savez(
            folder / "clips" / f"{name}.npz",
            t=np.arange(len(opening)) / 25 + 0.1,
            inner_opening_mean=opening,
            lip_width=mouth["width_mm"] / EYES_MM,
            protrusion=mouth["protrusion_mm"] / EYES_MM,
            jaw=mouth["jaw_mm"] / EYES_MM,
            valid=np.ones(len(opening)),
            words="[]",
        )
        records.append({"id": name, "speaker": f"talker{place}", "offset_s": 0.1})
    (folder / "manifest.json").write_text(json.dumps({"clips": records}))
    return read_clips(folder, folder / "rows")


def test_inputs_and_tracked_mouth_lie_at_the_same_moments(clips: list[Clip]) -> None:
    standardise(clips)
    for clip in clips:
        rules = clip.inputs[:, RULES_COLUMN] * RULES_UNIT_MM[0] + RULES_MIDDLE_MM[0]
        inside = clip.known & clip.speaking
        assert np.corrcoef(rules[inside], clip.targets[inside, 0])[0, 1] > 0.97


def test_talkers_and_sentences_are_held_out_whole(clips: list[Clip]) -> None:
    learned, held = split_talkers(clips)
    assert {clip.talker for clip in learned}.isdisjoint(clip.talker for clip in held)
    assert len(learned) == 4 and len(held) == 1
    read, unread = split_sentences(clips)
    assert len(unread) == 1 and len(read) == 4


def test_a_trained_model_opens_the_head_as_far_as_its_talkers(
    clips: list[Clip], speech_wav: Path, tmp_path: Path
) -> None:
    speech, told = standardise(clips), []
    network = fit(clips, clips, speech, 1, SHORT, told.append)
    assert len(told) == 3 and "epoch 3" in told[-1]
    assert correlations([network], clips)["opening_mm"] > 0.9
    found = calibrate([network], clips, speech, middle_of_rules_mm(clips), EYES_MM)
    path = tmp_path / "small.onnx"
    write_model([network], found, path)
    model = open_model(path)
    assert model.makes_contacts and model.name == "small.onnx" and "plain" in model.styles
    bare = measure_mouth(animate(speech_wav, model=path, contacts="off").motion)["opening_mm"]
    rules = measure_mouth(animate(speech_wav, contacts="off").motion)["opening_mm"]
    assert np.corrcoef(bare, rules)[0, 1] > 0.9
    assert np.percentile(bare, 95) == pytest.approx(2 * np.percentile(rules, 95), rel=0.3)


def test_a_record_that_is_damaged_is_refused(clips: list[Clip], tmp_path: Path) -> None:
    from elocute.training.onnx_export import add_to_record

    speech = standardise(clips)
    network = fit(clips, clips, speech, 1, FitSettings(channels=4, epochs=1, steps=1), print)
    found = calibrate([network], clips, speech, middle_of_rules_mm(clips), EYES_MM)
    for field, wrong in (("middle_mm", [1, 2]), ("opening_map", [[1, 0], [1, 2]]), ("inputs", 3)):
        path = tmp_path / f"{field}.onnx"
        write_model([network], found, path)
        add_to_record(path, **{field: wrong})
        with pytest.raises(ModelError, match=r"talkers|inputs"):
            animate(np.zeros(16000, np.float32), rate=16000, model=path)
