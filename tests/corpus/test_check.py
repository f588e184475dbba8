"""A clean corpus passes; each thing that spoils training is found and told."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import elocute
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.corpus.audio_sync import estimate_offset, expected_openness, lag_sums
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_checks import Finding, check_corpus
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.length_units import fitting_unit
from elocute.corpus.motion_checks import rigid_motion
from elocute.corpus.split import Split
from elocute.head.builtin import load_builtin_head

FPS = 60.0
KEPT = 600  # vertices of a corpus of vertices, spread over the head


@pytest.fixture(scope="module")
def takes(speech_wav) -> dict[str, Clip]:
    """The example in three styles: ten seconds of weights each."""
    sound = read_audio(speech_wav).resample(16000)
    return {
        style: Clip(
            style,
            f"own{style}",
            "",
            sound,
            elocute.animate(sound, fps=FPS, style=style, life=0).motion.weights,
        )
        for style in ("plain", "broad", "tense")
    }


def weights_corpus(folder: Path, clips: list[Clip]) -> Corpus:
    head = load_builtin_head()
    with corpus_writer(
        folder,
        {clip.subject: head.template for clip in clips},
        fps=FPS,
        basis=head.expression_basis,
        components=head.expression_names,
    ) as writer:
        for clip in clips:
            writer.add(clip)
    return open_corpus(folder)


def vertex_corpus_of(room: Path, clips: list[Clip], scale: float = 1.0) -> Corpus:
    folder = room / "c"
    head = load_builtin_head()
    with corpus_writer(
        folder, {clip.subject: np.float32(scale) * kept(head.template) for clip in clips}, fps=FPS
    ) as writer:
        for clip in clips:
            writer.add(replace(clip, frames=np.float32(scale) * held(clip)))
    return open_corpus(folder)


def held(clip: Clip) -> NDArray[np.float32]:
    """The clip's motion, which is in memory."""
    assert isinstance(clip.frames, np.ndarray)
    return clip.frames


def kept(points: np.ndarray) -> np.ndarray:
    """Some of the head's vertices, axis before last."""
    step = points.shape[-2] // KEPT
    return points[..., ::step, :]


def as_vertices(clip: Clip) -> Clip:
    head = load_builtin_head()
    moved = np.tensordot(held(clip), kept(head.expression_basis), 1)
    return replace(clip, frames=(kept(head.template) + moved).astype(np.float32))


def late(clip: Clip, seconds: float) -> Clip:
    """The same, its motion that much later, first or last frame held."""
    frames = np.arange(len(clip.frames)) - round(seconds * FPS)
    return replace(clip, frames=clip.frames[frames.clip(0, len(clip.frames) - 1)])


def told(findings: list[Finding], about: str) -> str:
    return "\n".join(finding.what for finding in findings if finding.about == about)


def test_the_simulated_corpus_is_clean(corpus: Corpus, vertex_corpus: Corpus) -> None:
    assert check_corpus(corpus) == []
    assert check_corpus(vertex_corpus) == []


def test_motion_that_runs_with_the_sound_is_clean(takes, tmp_path) -> None:
    done = []
    corpus = weights_corpus(tmp_path / "c", list(takes.values()))
    assert check_corpus(corpus, done.append) == []
    assert done[-1] == 1.0


@pytest.mark.parametrize("seconds", [0.2, -0.2])
def test_a_shift_of_a_whole_corpus_is_found(takes, tmp_path, seconds) -> None:
    corpus = weights_corpus(tmp_path / "c", [late(clip, seconds) for clip in takes.values()])
    findings = check_corpus(corpus)
    assert [(f.level, f.about) for f in findings] == [("error", "corpus")]
    assert f"ms {'after' if seconds > 0 else 'before'} the sound" in findings[0].what
    found_ms = float(findings[0].what.split(" ms")[0].split()[-1])
    assert found_ms == pytest.approx(200, abs=30)


def test_a_shift_of_one_subject_is_found(takes, tmp_path) -> None:
    clips = [late(clip, 0.2 if name == "tense" else 0.0) for name, clip in takes.items()]
    findings = check_corpus(weights_corpus(tmp_path / "c", clips))
    assert [f.about for f in findings] == ["tense"]
    assert "offset" in findings[0].what


def test_offsets_come_out_between_frames(takes) -> None:
    rng = np.random.default_rng(0)
    steps = np.repeat(rng.random(60), 8000)
    sound = Waveform((0.3 * steps * rng.normal(size=len(steps))).astype(np.float32), 48000)
    mouth = np.interp(np.arange(600) / 60 - 0.043, np.arange(1000) / 100, expected_openness(sound))
    sums = lag_sums(sound, mouth, 60.0)
    assert sums is not None
    assert estimate_offset(sums).seconds == pytest.approx(0.043, abs=0.004)
    assert lag_sums(sound, np.ones(600), 60.0) is None
    assert lag_sums(sound, mouth[:60], 60.0) is None


def test_numbers_that_are_none_are_found(takes, tmp_path) -> None:
    clip = as_vertices(takes["plain"])
    held(clip)[321, 7, 1] = np.nan
    corpus = vertex_corpus_of(tmp_path, [clip, as_vertices(takes["broad"])])
    findings = check_corpus(corpus)
    assert [(f.about, f.what, f.frame) for f in findings] == [
        (clip.name, "motion: NaN or infinity", 321)
    ]


def test_jumps_are_found_in_vertices_and_in_weights(takes, tmp_path) -> None:
    clip = as_vertices(takes["plain"])
    held(clip)[200:, 5] += 0.03
    findings = check_corpus(vertex_corpus_of(tmp_path, [clip]))
    assert [(f.about, f.frame) for f in findings if "jump" in f.what] == [(clip.name, 200)]
    weights = takes["plain"].frames.copy()
    weights[128, load_builtin_head().expression_index("jawOpen")] = 4
    bad = replace(takes["plain"], frames=weights)
    findings = check_corpus(weights_corpus(tmp_path / "w", [bad]))
    assert {f.frame for f in findings if "jump" in f.what} <= {128, 129} != set()
    assert "jump" in told(findings, clip.name)


@pytest.mark.parametrize(("scale", "unit"), [(1000.0, "mm"), (100.0, "cm"), (10.0, "dm")])
def test_units_are_told(takes, tmp_path, scale, unit) -> None:
    findings = check_corpus(vertex_corpus_of(tmp_path, [as_vertices(takes["plain"])], scale))
    assert f"it fits a head in {unit}" in told(findings, "plain")


def test_units_fit_heads() -> None:
    sizes = {"mm": 230.0, "cm": 23.0, "dm": 2.3, "inch": 9.0, "": 1e6}
    assert {unit: fitting_unit(size) for unit, size in sizes.items()} == {u: u for u in sizes}


def test_a_head_that_is_turned_or_shifted_is_found(takes, tmp_path) -> None:
    turned, shifted = as_vertices(takes["plain"]), as_vertices(takes["broad"])
    angle = np.radians(4)
    about_y = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    clips = [
        replace(turned, frames=held(turned) @ about_y.T.astype(np.float32)),
        replace(shifted, frames=held(shifted) + np.float32(0.008)),
        as_vertices(takes["tense"]),
    ]
    findings = check_corpus(vertex_corpus_of(tmp_path, clips))
    assert "turned 4" in told(findings, turned.name)
    assert "shifted 13.9 mm" in told(findings, shifted.name)
    assert told(findings, "tense.owntense") == ""


def test_rigid_motion_is_measured() -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    assert rigid_motion(points, points) == pytest.approx((0, 0), abs=1e-5)
    degrees, metres = rigid_motion((points - points.mean(0)) @ turn.T + points.mean(0) + 1, points)
    assert (degrees, metres) == pytest.approx((90, np.sqrt(3)))


def test_a_mouth_that_does_not_move_is_found(takes, tmp_path) -> None:
    clips = [replace(takes["plain"], frames=0 * takes["plain"].frames), takes["broad"]]
    findings = check_corpus(weights_corpus(tmp_path / "c", clips))
    assert "still" in told(findings, "plain.ownplain")
    assert len(findings) == 1


def test_sound_of_another_length_is_found(takes, tmp_path) -> None:
    clips = [
        replace(takes["plain"], frames=takes["plain"].frames[:-6]),
        replace(takes["broad"], frames=takes["broad"].frames[:-90]),
    ]
    findings = check_corpus(weights_corpus(tmp_path / "c", clips))
    assert [f.level for f in findings] == ["warning", "error"]
    assert "length: sound is 0.10 s longer than motion" in findings[0].what
    assert "length: sound is 1.50 s longer than motion" in findings[1].what


def test_sound_that_is_cut_or_missing_is_found(takes, tmp_path) -> None:
    corpus = weights_corpus(tmp_path / "c", list(takes.values()))
    path = corpus.sound_path("plain.ownplain")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    corpus.sound_path("tense.owntense").unlink()
    findings = check_corpus(corpus)
    assert all(f.level == "error" and f.what.startswith("sound: ") for f in findings)
    assert [f.about for f in findings] == ["plain.ownplain", "tense.owntense"]


def test_leaks_and_broken_templates_are_found(takes, tmp_path) -> None:
    clips = [takes["plain"], replace(takes["broad"], sentence="ownplain")]
    corpus = weights_corpus(tmp_path / "c", clips)
    split = Split((clips[0].name,), (), (clips[1].name,))
    findings = check_corpus(replace(corpus, splits={"default": split}))
    assert told(findings, "split default") == "sentence 'ownplain' is in test and train"
    alone = Split((clips[0].name,), (), (f"plain.{clips[1].sentence}2",))
    more = [clips[0], replace(clips[1], subject="plain", sentence="ownplain2")]
    lone = weights_corpus(tmp_path / "lone", more)
    assert [f.level for f in check_corpus(replace(lone, splits={"a": alone}))] == ["warning"]
    copy = tmp_path / "copy"
    shutil.copytree(corpus.folder, copy)
    templates = np.array(corpus.templates)
    templates[1, 3] = np.inf
    np.save(copy / "templates.npy", templates)
    assert told(check_corpus(open_corpus(copy)), "broad") == "template: NaN or infinity"
