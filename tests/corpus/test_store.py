"""A corpus on disk gives back what went in, and refuses what is not one."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_statistics import displacement_blocks, moments
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.split import Split
from elocute.errors import CorpusError
from elocute.files.array_file import ArrayFile

RNG = np.random.default_rng(0)


def small_clip(subject: str = "ada", sentence: str = "s1", frames: int = 20) -> Clip:
    sound = Waveform(RNG.normal(0, 0.1, 8000).astype(np.float32), 16000)
    return Clip(
        subject, sentence, "hello", sound, RNG.normal(size=(frames, 5, 3)).astype(np.float32)
    )


def test_clips_come_back_as_they_went_in(tmp_path: Path) -> None:
    template = RNG.normal(size=(5, 3)).astype(np.float32)
    clips = [small_clip("ada", "s1"), small_clip("ben", "s1", 7), small_clip("ada", "s2", 1)]
    with corpus_writer(tmp_path / "c", {"ada": template, "ben": -template}, fps=30) as writer:
        for clip in clips:
            writer.add(clip)
    corpus = open_corpus(tmp_path / "c")
    assert corpus.subjects == ("ada", "ben")
    assert corpus.frame_count == 28
    for clip in clips:
        back = corpus.clip(clip.name)
        np.testing.assert_array_equal(back.frames, clip.frames)
        np.testing.assert_allclose(back.sound.samples, clip.sound.samples, atol=2**-15)
        assert (back.text, back.subject) == ("hello", clip.subject)
    np.testing.assert_allclose(
        corpus.displacements("ben.s1"), clips[1].frames + template, atol=1e-6
    )


def test_frames_stay_on_disk_until_they_are_read(corpus: Corpus, tmp_path: Path) -> None:
    """A corpus that is cut short while it is read is an error of ours, not a crash (SIGBUS)."""
    shutil.copytree(corpus.folder, tmp_path / "corpus")
    copied = open_corpus(tmp_path / "corpus")
    view = copied.frames("plain.s0")
    assert isinstance(view, ArrayFile) and view.shape == corpus.frames("plain.s0").shape
    os.truncate(tmp_path / "corpus" / "motion.npy", 1000)
    with pytest.raises(CorpusError, match=r"motion\.npy: cut short while it was read"):
        copied.vertices("plain.s0")


def test_weights_expand_to_the_vertices_they_mean(corpus: Corpus) -> None:
    weights = np.asarray(corpus.frames("broad.s1"))
    assert corpus.basis is not None
    expected = corpus.template("broad") + np.tensordot(weights, corpus.basis, 1)
    np.testing.assert_allclose(corpus.vertices("broad.s1"), expected, atol=1e-6)


def test_moments_in_blocks_are_those_of_all_frames(corpus: Corpus) -> None:
    names = [entry.name for entry in corpus.entries]
    everything = np.concatenate([corpus.displacements(name) for name in names]).astype(float)
    gathered = moments(displacement_blocks(corpus, names))
    assert gathered.count == len(everything)
    np.testing.assert_allclose(gathered.mean, everything.mean(0), atol=1e-9)
    np.testing.assert_allclose(gathered.variance, everything.var(0), atol=1e-12)


def test_an_interrupted_corpus_leaves_nothing(tmp_path: Path) -> None:
    template = np.zeros((5, 3), np.float32)
    with (
        pytest.raises(KeyboardInterrupt),
        corpus_writer(tmp_path / "c", {"ada": template}, fps=30) as writer,
    ):
        writer.add(small_clip())
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("clip", "told"),
    [
        (small_clip("ben"), "subject without template"),
        (Clip("ada", "s1", "", small_clip().sound, np.zeros((3, 4, 3), np.float32)), r"\(5, 3\)"),
        (
            Clip(
                "ada",
                "s1",
                "",
                Waveform(np.zeros(9000, np.float32), 700_000),
                np.zeros((3, 5, 3), np.float32),
            ),
            "sound at 700000 Hz",
        ),
    ],
)
def test_clips_that_do_not_fit_are_refused(tmp_path: Path, clip: Clip, told: str) -> None:
    with (
        pytest.raises(CorpusError, match=told),
        corpus_writer(tmp_path / "c", {"ada": np.zeros((5, 3), np.float32)}, fps=30) as writer,
    ):
        writer.add(clip)


@pytest.mark.parametrize("name", ["../up", "", "a/b", ".hidden", "x" * 200])
def test_names_that_could_be_paths_are_refused(name: str) -> None:
    with pytest.raises(CorpusError, match="plain name"):
        small_clip(subject=name)


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("fps", -1, "fps"),
        ("kind", "meshes", "kind"),
        ("clips", [], "no clip"),
        ("subjects", ["../x"], "plain name"),
        ("splits", {"default": {"train": ["who"], "validation": [], "test": []}}, "who"),
        ("format", "other", "another kind"),
    ],
)
def test_broken_manifests_say_what_is_wrong(
    corpus: Corpus, tmp_path: Path, field: str, value: object, told: str
) -> None:
    folder = tmp_path / "broken"
    shutil.copytree(corpus.folder, folder)
    record = json.loads((folder / "corpus.json").read_text())
    record[field] = value
    (folder / "corpus.json").write_text(json.dumps(record))
    with pytest.raises(CorpusError, match=told) as caught:
        open_corpus(folder)
    assert "\n" not in str(caught.value)


def test_arrays_that_do_not_fit_the_manifest_are_refused(corpus: Corpus, tmp_path: Path) -> None:
    folder = tmp_path / "broken"
    shutil.copytree(corpus.folder, folder)
    np.save(folder / "motion.npy", np.zeros((10, 3), np.float32))
    with pytest.raises(CorpusError, match=r"motion\.npy"):
        open_corpus(folder)
    np.save(folder / "motion.npy", np.array([{"a": 1}], object), allow_pickle=True)
    with pytest.raises(CorpusError, match="an array of Python objects"):
        open_corpus(folder)


def test_a_split_is_read_by_its_name(corpus: Corpus, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(corpus.folder, folder)
    manifest = json.loads((folder / "corpus.json").read_text())
    manifest["splits"]["tiny"] = {"train": ["plain.s0"], "validation": ["broad.s1"], "test": []}
    (folder / "corpus.json").write_text(json.dumps(manifest))
    assert open_corpus(folder).split("tiny") == Split(("plain.s0",), ("broad.s1",), ())
    with pytest.raises(CorpusError, match="default, tiny"):
        open_corpus(folder).split("none")
