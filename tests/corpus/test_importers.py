"""Corpora of others become corpus folders; what cannot be used is told, never half-written."""

from __future__ import annotations

import pickle
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from elocute.corpus.corpus_checks import check_corpus
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.importers.biwi import convert_biwi
from elocute.corpus.importers.folder import convert_folder
from elocute.corpus.importers.grid import SCALARS, grid_clips, read_tracked_lips
from elocute.corpus.importers.registry import convert, detect_format
from elocute.corpus.importers.split_choice import (
    BIWI_SEEN,
    VOCASET_TEST,
    VOCASET_TRAIN,
    VOCASET_VALIDATION,
)
from elocute.corpus.importers.vocaset import convert_vocaset
from elocute.corpus.length_units import metres_per_unit
from elocute.corpus.split import find_leaks
from elocute.errors import CorpusError, InputError
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth

TWO = (
    VOCASET_TRAIN[0],
    VOCASET_VALIDATION[0],
    VOCASET_TEST[0],
)


@pytest.fixture
def voca(tmp_path, sources, python2):
    return tmp_path / "VOCASET", sources.write_vocaset(tmp_path / "VOCASET", python2, TWO)


def converted(source: Path, **options) -> tuple[Corpus, list[str]]:
    output = source.parent / "out"
    notes = convert(source, output, **options)
    return open_corpus(output), notes


def refused(source: Path, told: str, **options) -> None:
    with pytest.raises(InputError, match=told) as caught:
        convert(source, source.parent / "out", **options)
    assert "\n" not in str(caught.value)
    assert [path.name for path in source.parent.iterdir()] == [source.name]


def test_vocaset_comes_through_bit_for_bit(voca):
    source, given = voca
    corpus, notes = converted(source)
    assert notes == []
    assert (corpus.fps, corpus.kind, corpus.topology) == (60.0, "vertices", "flame")
    assert corpus.subjects == TWO  # the order of the released code, not of the alphabet
    for entry in corpus.entries:
        number = entry.sentence.rsplit("_", 1)[1]
        rows = list(given["rows"][entry.subject][number].values())
        np.testing.assert_array_equal(corpus.frames(entry.name), given["vertices"][rows])
        audio = given["sounds"][entry.subject][number]["audio"]
        np.testing.assert_array_equal(corpus.sound(entry.name).samples * 32768, audio)
    np.testing.assert_array_equal(
        corpus.template(TWO[1]), given["templates"][TWO[1]].astype(np.float32)
    )


def test_the_published_split_keeps_own_sentences_only(voca):
    corpus, _ = converted(voca[0])
    split = corpus.split()
    assert len(split.train) == 3
    assert [name.rsplit("_", 1)[1] for name in split.validation] == ["sentence21", "sentence40"]
    assert [name.rsplit("_", 1)[1] for name in split.test] == ["sentence21", "sentence40"]
    assert find_leaks(corpus.entries, split) == []


def test_sentences_have_one_name_where_the_words_are_the_same(voca, tmp_path):
    texts = tmp_path / "VOCASET" / "texts.tsv"
    texts.write_text(
        f"{TWO[0]}\tsentence01\tShe had.\n{TWO[1]}\tsentence40\tshe  HAD\n"
        f"{TWO[1]}\tsentence21\tshe had!\n"
    )
    corpus, _ = converted(voca[0], texts=texts)
    by_text = {e.name: e.sentence for e in corpus.entries if e.text}
    assert len(by_text) == 3 and len({s.split("-")[0] for s in by_text.values()}) == 1
    assert any("_sentence" in entry.sentence for entry in corpus.entries)


def test_other_subjects_get_an_even_split(tmp_path, sources, python2):
    sources.write_vocaset(tmp_path / "v", python2, ("ann", "bob", "cy"), (1, 2))
    corpus, notes = converted(tmp_path / "v")
    assert any(note.startswith("split: even") for note in notes)
    assert find_leaks(corpus.entries, corpus.split()) == []
    assert all(corpus.split().parts().values())


def test_vocaset_tells_what_it_skips(voca, python2):
    source, given = voca
    del given["sounds"][TWO[0]]["sentence21"]
    del given["rows"][TWO[2]]["sentence01"]
    given["rows"]["stranger"] = {"sentence01": {0: 0}}
    given["sounds"][TWO[0]]["sentence40"] = {"audio": np.zeros(9, np.int16)}
    (source / "raw_audio_fixed.pkl").write_bytes(python2.dumps(given["sounds"]))
    (source / "subj_seq_to_idx.pkl").write_bytes(python2.dumps(given["rows"]))
    corpus, notes = converted(source, leave_out=frozenset([TWO[1]]))
    assert len(corpus.entries) == 3
    told = "\n".join(notes)
    assert f"{TWO[0]} sentence21: no sound" in told and f"{TWO[2]} sentence01: no motion" in told
    assert "stranger: no template" in told and "without audio and sample_rate" in told


def test_vocaset_is_refused_by_name(voca, python2):
    source, given = voca
    np.save(source / "data_verts.npy", given["vertices"][:, :5000])
    refused(source, "5000 vertices; allowed: .*5023")
    np.save(source / "data_verts.npy", given["vertices"][:100])
    refused(source, rf"{TWO[1]} sentence40.*: row 100; allowed: 0 to 99")
    np.save(source / "data_verts.npy", np.array([{}], object), allow_pickle=True)
    refused(source, "Python objects")
    np.save(source / "data_verts.npy", given["vertices"])
    (source / "templates.pkl").write_bytes(b"cos\nsystem\n(S'true'\ntR.")
    refused(source, r"os\.system")
    (source / "templates.pkl").write_bytes(python2.dumps(given["templates"])[:5000])
    refused(source, "templates.pkl")
    (source / "templates.pkl").write_bytes(python2.dumps({"ann": np.zeros((7, 3))}))
    refused(source, "7 vertices .* ann; allowed: 5023")
    (source / "templates.pkl").unlink()
    refused(source, "no templates.pkl")


def test_the_folder_convention_is_read(tmp_path, sources):
    sources.write_folder(tmp_path / "f", ("A_B", "A", "C"))
    (tmp_path / "f" / "wav" / "A_e02.wav").unlink()
    (tmp_path / "f" / "wav" / "C_e03.wav").write_bytes(b"RIFF")
    np.save(tmp_path / "f" / "vertices_npy" / "who_e01.npy", np.zeros((3, 180), np.float32))
    corpus, notes = converted(tmp_path / "f")
    assert corpus.fps == 30.0 and corpus.frames("A_B.e01").shape == (15, 60, 3)
    assert np.ptp(corpus.template("A"), axis=0).max() == pytest.approx(0.24, abs=0.02)
    told = "\n".join(notes)
    assert "taken as mm" in told and "A_e02: no sound" in told and "who_e01: no template" in told
    assert "C_e03: " in told
    assert find_leaks(corpus.entries, corpus.split()) == []


def test_the_folder_convention_is_refused_by_name(tmp_path, sources):
    source = tmp_path / "f"
    sources.write_folder(source, ("A", "B"))
    np.save(source / "vertices_npy" / "A_e00.npy", np.zeros((4, 99), np.float32))
    refused(source, "33 vertices; allowed: .* 60 vertices")
    np.save(source / "vertices_npy" / "A_e00.npy", np.array([None]), allow_pickle=True)
    refused(source, "Python objects")
    (source / "templates.pkl").write_bytes(pickle.dumps({"A": np.array([None])}))
    refused(source, "templates.pkl")


BIWI_CLIPS = tuple(
    f"{subject}_{sentence}"
    for subject, sentences in (
        *((name, ("e01", "e33", "e37")) for name in BIWI_SEEN),
        ("F1", ("e01", "e40")),
    )
    for sentence in sentences
)


@pytest.fixture(scope="module")
def prepared_biwi(tmp_path_factory, sources) -> Path:
    folder = tmp_path_factory.mktemp("prepared") / "BIWI"
    sources.write_prepared_biwi(folder, BIWI_CLIPS)
    return folder


def test_a_prepared_biwi_folder_is_known_by_its_mesh(prepared_biwi, tmp_path):
    """As FaceFormer and CodeTalker keep it: 25 frames/s, lost size, published split."""
    notes = convert(prepared_biwi, tmp_path / "out")
    corpus = open_corpus(tmp_path / "out")
    assert (corpus.fps, corpus.topology, corpus.vertex_count) == (25.0, "biwi", 23370)
    assert np.ptp(corpus.template("F2"), axis=0).max() == pytest.approx(0.25, rel=1e-3)
    assert {
        name: [len(part) for part in split.parts().values()]
        for name, split in corpus.splits.items()
    } == {
        "default": [6, 6, 6],
        "test-b": [6, 6, 1],
    }
    assert corpus.splits["test-b"].test == ("F1.e40",)
    assert len(notes) == 4  # each says what was assumed, three of them what changes it
    assert notes[0].startswith("mesh: BIWI's B3D(AC)2, by its 23370 vertices")
    for note, start, option in zip(
        notes[1:],
        ("lengths: ", "frames/s: 25", "split: "),
        ("`units`", "`fps`", "`split`"),
        strict=True,
    ):
        assert note.startswith(start) and option in note
    findings = check_corpus(corpus)
    assert {f.what for f in findings if f.about.startswith("split")} == {
        "parts share subjects but no sentence: measures hold for these people alone"
    }
    assert not [f for f in findings if f.what.startswith(("length", "template"))]


def test_a_biwi_scaled_to_a_box_is_told_from_one_scaled_to_a_surface(sources):
    """FaceXHuBERT's preparation scales each axis, FaceFormer's the whole."""
    points = sources.head_points(23370)
    box = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    notes: list[str] = []
    assert metres_per_unit(box, notes, None) == pytest.approx(0.25)
    assert "each axis scaled to 1" in notes[0] and "proportions" in notes[0]
    assert metres_per_unit(box * [0.8, 1.1, 0.7], notes, None) == pytest.approx(0.25 / 1.1)
    assert "scaled to a surface of 1" in notes[1]
    assert metres_per_unit(box, notes, "mm") == 0.001 and len(notes) == 2


def test_a_wrong_frame_rate_is_one_line_that_names_the_option(prepared_biwi, tmp_path):
    notes = convert(prepared_biwi, tmp_path / "out", fps=10.0, units="1", split="even")
    assert "frames/s: 10 as `fps` says, but the lengths of the sounds fit 25" in notes
    corpus = open_corpus(tmp_path / "out")
    assert np.ptp(corpus.template("F2"), axis=0).max() == pytest.approx(1.0, abs=0.02)
    told = [f for f in check_corpus(corpus) if f.what.startswith("length")]
    assert [f.about for f in told] == ["corpus"]
    assert "in 20 of 20 clips" in told[0].what and "`fps` 25" in told[0].what


@pytest.mark.parametrize(
    ("split", "expected"),
    [
        ("published", {"F2", "F3", "F4", "M3", "M4", "M5"}),
        ("M4/F1,M5", {"F1"}),
        ("sentences", {"F1"}),
    ],
)
def test_the_split_is_ones_choice(prepared_biwi, tmp_path, split, expected):
    convert(prepared_biwi, tmp_path / "out", split=split, leave_out=frozenset(["F3.e01"]))
    corpus = open_corpus(tmp_path / "out")
    assert {corpus.entry(clip).subject for clip in corpus.split().test} == expected


def test_splits_and_units_that_are_none_are_refused(prepared_biwi, tmp_path):
    refused_options: tuple[tuple[dict[str, Any], str], ...] = (
        ({"split": "odd"}, "published, even, sentences"),
        ({"split": "F1/"}, "published, even, sentences"),
        ({"split": "F1/F1"}, "F1 in two parts"),
        ({"split": "F1/ann"}, "no subject ann"),
        ({"split": "F1/M5"}, "no sentence left"),
        ({"units": "mile"}, "mm, cm, dm, inch, or metres"),
        ({"units": "nan"}, "no unit of length"),
        ({"units": "0"}, "no unit of length"),
    )
    for options, told in refused_options:
        with pytest.raises(CorpusError, match=told):
            convert(prepared_biwi, tmp_path / "out", **options)
        assert list(tmp_path.iterdir()) == []


def test_a_published_split_needs_its_sentences(tmp_path, sources):
    sources.write_prepared_biwi(tmp_path / "b", ("F2_e01", "F2_e37"))
    refused(tmp_path / "b", "part without clips; allowed: VOCASET", split="published")
    _, notes = converted(tmp_path / "b")
    assert any("by sentences only" in note and "`split`" in note for note in notes)


def test_many_clips_without_sound_are_one_line(tmp_path, sources):
    sources.write_folder(tmp_path / "f", ("A", "B"))
    for path in (tmp_path / "f" / "wav").glob("*_e0[1-3].wav"):
        path.unlink()
    _, notes = converted(tmp_path / "f")
    assert "no sound: 6 clips (A_e01, A_e02, A_e03 and 3 more)" in notes


def test_biwi_sounds_under_other_names_are_asked_for(tmp_path, sources):
    sources.write_biwi(tmp_path / "b", ("F1", "M1"))
    for path in (tmp_path / "b" / "wav").iterdir():
        path.rename(path.with_name(path.name.replace("_", "-")))
    refused(
        tmp_path / "b",
        r"no clip that can be used \(no sound: 4 clips .*"
        r"SUBJECT_SENTENCE_cut\.wav, .* in audio/ or wav/; there is F1-02\.wav",
    )
    (tmp_path / "b" / "wav").rename(tmp_path / "b" / "audio")
    for path in (tmp_path / "b" / "audio").iterdir():
        path.rename(path.with_name(path.stem.replace("-", "_") + "_cut.wav"))
    corpus, _ = converted(tmp_path / "b")
    assert len(corpus.entries) == 4


def test_biwi_is_read_turned_and_scaled(tmp_path, sources):
    sources.write_biwi(tmp_path / "b", ("F1", "M1", "M2"))
    lost = tmp_path / "b" / "faces" / "F1" / "02"
    (lost / "frame_003.vl").rename(lost / "._frame_004.vl")  # as a Mac leaves them
    broken = tmp_path / "b" / "faces" / "M1" / "02" / "frame_004.vl"
    broken.write_bytes(broken.read_bytes()[:-4])
    corpus, notes = converted(tmp_path / "b")
    expected = sources.head_points(50, 0) * [1, -1, -1]
    np.testing.assert_allclose(corpus.template("F1"), expected, atol=1e-6)
    assert (corpus.fps, corpus.frames("F1.e01").shape) == (25.0, (10, 50, 3))
    assert corpus.faces is not None and corpus.faces.shape == (1, 4)
    told = "\n".join(notes)
    assert (
        "taken as cm" in told
        and "half a turn" in told
        and "F1 02: 1 frame missing between others, interpolated" in told
    )
    moved = np.asarray(corpus.frames("F1.02"), np.float64)
    assert moved.shape == (
        10,
        50,
        3,
    )  # as long as the sound, the third frame between its neighbours
    np.testing.assert_allclose(moved[2], (moved[1] + moved[3]) / 2, atol=1e-6)
    np.testing.assert_array_equal(moved[3:], np.asarray(corpus.frames("F1.e01"))[3:])
    assert "600 bytes; allowed: 604 for 50 vertices" in told
    assert "M1.02" not in corpus.by_name


def test_biwi_of_another_topology_is_refused(tmp_path, sources):
    sources.write_biwi(tmp_path / "b", ("F1", "M1"))
    frame = tmp_path / "b" / "faces" / "M1" / "e01" / "frame_002.vl"
    frame.write_bytes(np.int32(2).tobytes() + bytes(24))
    refused(tmp_path / "b", "2 vertices; allowed: 50")
    shutil.rmtree(tmp_path / "b" / "rigid_scans")
    refused(tmp_path / "b", "no neutral face")


def test_formats_are_found_out(tmp_path, sources, voca):
    assert detect_format(voca[0]) == "vocaset"
    sources.write_folder(tmp_path / "f", ("A",))
    sources.write_biwi(tmp_path / "b", ("F1",))
    assert detect_format(tmp_path / "f") == "folder"
    assert detect_format(tmp_path / "b") == "biwi"
    (tmp_path / "empty").mkdir()
    with pytest.raises(CorpusError, match="vocaset, biwi, folder, grid"):
        detect_format(tmp_path / "empty")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"format": "obj"}, "vocaset, biwi"),
        ({"fps": 0.0}, "no frame rate"),
        ({"fps": 30.0}, "vocaset has 60"),
    ],
)
def test_options_that_do_not_fit_are_refused(voca, options, told):
    refused(voca[0], told, **options)


def test_converters_can_be_called_by_themselves(tmp_path, sources, voca):
    sources.write_folder(tmp_path / "f", ("A",))
    sources.write_biwi(tmp_path / "b", ("F1",))
    assert convert_vocaset(voca[0], tmp_path / "1") == []
    assert convert_folder(tmp_path / "f", tmp_path / "2", fps=15.0)
    assert convert_biwi(tmp_path / "b", tmp_path / "3")
    assert [open_corpus(tmp_path / n).fps for n in "123"] == [60.0, 15.0, 25.0]


@pytest.mark.shared_data
def test_real_lips_move_the_head_as_they_were_tracked(shared_data, tmp_path):
    given = sorted((shared_data / "grid_s1" / "clips").glob("*.npz"))[::160]
    for path in given:
        for part in (path, path.with_suffix(".ogg")):
            shutil.copy(part, tmp_path / part.name)
    head = load_builtin_head()
    closed = together = 0
    for clip, residual_mm in grid_clips(tmp_path, leave_out={given[0].stem}, fps=25.0):
        assert clip.subject == "grid" and clip.sentence != given[0].stem
        assert len(clip.text.split()) == 6
        frames = clip.frames[:]
        assert frames.min() >= 0 and frames.max() <= 1
        assert residual_mm < 1.5
        track = read_tracked_lips(tmp_path / f"{clip.sentence}.npz")
        tracked = track.scalars["inner_opening_mean"]
        measures = measure_mouth(Motion(head, frames, 25.0))
        count = min(len(tracked), len(frames))
        opening = measures["opening_mm"][:count]
        assert np.corrcoef(opening, tracked[:count])[0, 1] > 0.95
        width = np.corrcoef(measures["width_mm"][:count], track.scalars["lip_width"][:count])
        assert width[0, 1] > 0.9
        together += (tracked[:count] < 0.02).sum()
        closed += (opening[tracked[:count] < 0.02] < 0.3).sum()
    assert closed >= 0.95 * together > 0


@pytest.mark.shared_data
def test_real_lips_become_a_corpus(shared_data, tmp_path):
    given = sorted((shared_data / "grid_s1" / "clips").glob("*.npz"))[::300]
    source = tmp_path / "g"
    source.mkdir()
    for path in given:
        shutil.copy(path, source)
        shutil.copy(path.with_suffix(".ogg"), source)
    (source / f"{given[0].stem}.ogg").unlink()
    np.savez(source / "zzz.npz", lip_xyz=np.zeros(3))
    corpus, notes = converted(source, fps=60.0)
    assert len(corpus.entries) == len(given) - 1
    assert corpus.entries[0].frames == pytest.approx(180, abs=3)
    told = "\n".join(notes)
    assert "zzz.npz" in told and given[0].stem in told and "residual: 0." in told


def test_a_tracked_clip_without_its_fields_is_refused(tmp_path):
    without: tuple[dict[str, Any], ...] = (
        {"t": np.zeros(3)},
        {name: np.zeros(3) for name in SCALARS},
    )
    for fields in without:
        np.savez(tmp_path / "a.npz", **fields)
        with pytest.raises(CorpusError, match=r"a\.npz: no tracked lips"):
            read_tracked_lips(tmp_path / "a.npz")
    with pytest.raises(CorpusError, match="nowhere a closed mouth"):
        next(grid_clips(tmp_path, leave_out=set(), fps=60.0))
    soundfile.write(tmp_path / "b.wav", np.zeros(100), 16000)
    with pytest.raises(CorpusError, match=r"no NAME\.npz"):
        next(grid_clips(tmp_path, leave_out={"a"}, fps=60.0))
