"""Frames that are missing or not finite: filled where that is safe, told always, never shifted."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from elocute.corpus.corpus_statistics import displacement_blocks
from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.importers.frame_gaps import filled, frame_rows
from elocute.corpus.importers.registry import convert
from elocute.errors import CorpusError
from elocute.files.array_file import ArrayFile
from elocute.files.reading import ANY_BYTES, FileKind
from elocute.training.corpus_data import check_finite, motion_space


def test_gaps_are_filled_by_straight_lines():
    rows, told = frame_rows([1, 2, 5, 6], 1, 25.0, 0.24)
    assert rows.tolist() == [0, 1, 4, 5] and told == "2 frames missing between others, interpolated"
    known = np.array([0, 3, 9, 5], np.float32)[:, None, None] * np.ones((1, 1, 3), np.float32)
    assert filled(known, rows)[:, 0, 0].tolist() == pytest.approx([0, 3, 5, 7, 9, 5])
    rows, told = frame_rows([0, 1, 2, 3], 0, 60.0, None)
    assert told == "" and filled(known, rows) is known


def test_every_second_frame_keeps_the_times_of_its_numbers():
    rows, told = frame_rows(range(1, 20, 2), 1, 25.0, 0.76)
    assert rows.tolist() == list(range(0, 19, 2)) and told.startswith("9 frames missing")


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ([1, 2, 9, 10], "6 frames missing in a row, after frame 2"),
        ([1, 2, 2, 3], "frame 2 twice"),
        ([3, 4, 5, 6], "the first 2 frames missing"),
    ],
)
def test_what_cannot_be_filled_is_left_out(numbers: list[int], told: str):
    """Six frames of sound; a gap of 0.2 s, five frames, would be filled."""
    assert frame_rows([1, 2, 8, 9], 1, 25.0, 0.4)[0].tolist() == [0, 1, 7, 8]
    with pytest.raises(CorpusError, match=told):
        frame_rows(numbers, 1, 25.0, 0.24)


def test_sound_cut_to_frames_that_begin_later_is_in_step():
    """Numbers of the uncut recording, and sound as long as the frames that are left."""
    assert frame_rows([31, 32, 33], 1, 25.0, 0.12)[0].tolist() == [0, 1, 2]


def test_vocaset_with_a_frame_missing_stays_in_step(tmp_path, sources, python2):
    given = sources.write_vocaset(tmp_path / "v", python2, ("A",))
    path = tmp_path / "v" / "subj_seq_to_idx.pkl"
    rows = given["rows"]
    sentence, later = list(rows["A"])[:2]
    whole = dict(rows["A"][sentence])
    numbers = list(whole)
    del rows["A"][sentence][numbers[2]]
    for number in list(rows["A"][later])[1:]:
        rows["A"][later][number + 40] = rows["A"][later].pop(number)
    path.write_bytes(python2.dumps(rows, 2))
    notes = convert(tmp_path / "v", tmp_path / "out")
    corpus = open_corpus(tmp_path / "out")
    found = np.asarray(corpus.frames(f"A.A_{sentence}"), np.float64)
    expected = given["vertices"][list(whole.values())].astype(np.float64)
    expected[2] = (expected[1] + expected[3]) / 2
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert f"A {sentence}: 1 frame missing between others, interpolated" in notes
    assert any(note.startswith(f"A {later}: 40 frames missing in a row") for note in notes)
    assert f"A.A_{later}" not in corpus.by_name


def test_nan_is_named_with_its_file_and_frame(tmp_path, sources):
    sources.write_folder(tmp_path / "f", ("A", "B", "C"))
    array = tmp_path / "f" / "vertices_npy" / "B_e02.npy"
    frames = np.load(array)
    frames[7, 5] = np.nan
    np.save(array, frames)
    notes = convert(tmp_path / "f", tmp_path / "out")
    assert f"B_e02: {array}: NaN or infinity in frame 7 of 15; allowed: finite numbers" in notes
    assert "B.e02" not in open_corpus(tmp_path / "out").by_name


def test_displacements_and_other_units_are_no_faces(tmp_path, sources):
    sources.write_folder(tmp_path / "f", ("A", "B", "C"))
    templates = pickle.loads((tmp_path / "f" / "templates.pkl").read_bytes())
    names = ("A_e00", "B_e01", "C_e02")
    arrays = {name: tmp_path / "f" / "vertices_npy" / f"{name}.npy" for name in names}
    np.save(arrays["A_e00"], np.load(arrays["A_e00"]) - templates["A"].reshape(-1))
    np.save(arrays["B_e01"], 1000 * np.load(arrays["B_e01"]))
    frames = np.load(arrays["C_e02"])
    frames[3, 4] = 1e30
    np.save(arrays["C_e02"], frames)
    told = "\n".join(convert(tmp_path / "f", tmp_path / "out"))
    assert "apart at most, beside a head of 2" in told
    assert "displacements; allowed: vertices; add the neutral face to every frame" in told
    assert f"{arrays['B_e01']}: " in told and "in the unit of the neutral face" in told
    assert "1e+30 in frame 3, beside a head" in told
    left = open_corpus(tmp_path / "out").by_name
    assert len(left) == 9 and not {"A.e00", "B.e01", "C.e02"} & set(left)
    sources.write_folder(tmp_path / "g", ("A",))
    for path in (tmp_path / "g" / "vertices_npy").iterdir():
        np.save(path, np.load(path) - templates["A"].reshape(-1))
    with pytest.raises(CorpusError, match="displacements"):
        convert(tmp_path / "g", tmp_path / "all")


def test_nan_in_a_corpus_is_named_before_anything_is_learned(tmp_path, sources):
    sources.write_folder(tmp_path / "f", ("A",))
    convert(tmp_path / "f", tmp_path / "out")
    motion = np.load(tmp_path / "out" / "motion.npy")
    motion[15 + 4, 3, 1] = np.inf
    np.save(tmp_path / "out" / "motion.npy", motion)
    corpus = open_corpus(tmp_path / "out")
    names = [entry.name for entry in corpus.entries]
    for learn in (motion_space, lambda c, n: list(displacement_blocks(c, n))):
        with pytest.raises(CorpusError, match=rf"clip {names[1]}: NaN or infinity in frame 4"):
            learn(corpus, names)
    with pytest.raises(CorpusError, match=r"clip x: NaN or infinity in frame 2"):
        check_finite("x", np.array([[0.0], [1], [np.nan]]))


def test_arrays_by_columns_and_templates_as_lists_are_read(tmp_path, sources):
    """Fortran's order, as MATLAB and some of NumPy's functions leave arrays."""
    sources.write_folder(tmp_path / "f", ("A",))
    convert(tmp_path / "f", tmp_path / "plain")
    for path in (tmp_path / "f" / "vertices_npy").iterdir():
        np.save(path, np.asfortranarray(np.load(path)))
    templates = tmp_path / "f" / "templates.pkl"
    given = pickle.loads(templates.read_bytes())
    templates.write_bytes(pickle.dumps({name: face.tolist() for name, face in given.items()}))
    assert convert(tmp_path / "f", tmp_path / "columns")  # the frame rate is found out, too
    plain, columns = open_corpus(tmp_path / "plain"), open_corpus(tmp_path / "columns")
    np.testing.assert_array_equal(columns.motion[:], plain.motion[:])
    np.testing.assert_array_equal(columns.templates, plain.templates)
    assert columns.fps == plain.fps == 30.0


@pytest.mark.parametrize("value", [[[1.0, 2.0], [3.0]], "text", [["a", "b", "c"]], {}, [], [1, 2]])
def test_templates_that_are_none_are_told(tmp_path: Path, sources, value: object):
    sources.write_folder(tmp_path / "f", ("A",))
    (tmp_path / "f" / "templates.pkl").write_bytes(pickle.dumps({"A": value}))
    with pytest.raises(CorpusError, match=r"the template of A is .*\(vertices, 3\) numbers"):
        convert(tmp_path / "f", tmp_path / "out")


def test_rows_of_an_array_by_columns(tmp_path: Path):
    whole = np.arange(7 * 5 * 3, dtype=np.float32).reshape(7, 5, 3)
    np.save(tmp_path / "a.npy", np.asfortranarray(whole))
    found = ArrayFile(tmp_path / "a.npy", FileKind("rows", ANY_BYTES))
    assert not np.load(tmp_path / "a.npy").flags.c_contiguous
    np.testing.assert_array_equal(found[:], whole)
    np.testing.assert_array_equal(found[[5, 1, 2]], whole[[5, 1, 2]])
    np.testing.assert_array_equal(found.part(2, 6).part(1, 3)[1], whole[4])
