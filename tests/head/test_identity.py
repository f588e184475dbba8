"""Names, seeds and files become coefficients, or one clear line."""

import json

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.head.identity import identity_names, resolve_identity, sample_identity


def test_mean_is_zero():
    assert not resolve_identity("mean").any()


def test_eight_people_have_names():
    assert len(identity_names()) == 9
    faces = np.stack([resolve_identity(name) for name in identity_names()])
    assert faces.shape == (9, 50)
    apart = np.linalg.norm(faces[:, None] - faces[None], axis=2)
    assert apart[~np.eye(9, dtype=bool)].min() > 1.0


def test_a_seed_always_gives_the_same_face():
    assert np.array_equal(resolve_identity("42"), sample_identity(42))
    assert not np.array_equal(resolve_identity("42"), resolve_identity("43"))


def test_a_file_gives_its_numbers(tmp_path):
    numbers = np.linspace(-2, 2, 50)
    path = tmp_path / "me.json"
    path.write_text(json.dumps({"identity": numbers.tolist()}))
    assert np.allclose(resolve_identity(str(path)), numbers)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('{"identity": [1, 2]}', "2 numbers"),
        ('{"identity": [' + "9," * 49 + "9]}", r"identity\[0\] is 9"),
        ('{"identity": [' + "0," * 49 + "NaN]}", r"NaN is no number"),
        ('{"weights": []}', "not one list of numbers"),
        ("[1, 2", "no JSON"),
        ('{"identity": "ada"}', "not one list of numbers"),
        ('{"identity": [[1], [2]]}', "not one list"),
        ("[" * 50_000, "no JSON"),
        ("x" * 200_000, "200 kB"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, text, found):
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(HeadError, match=found) as caught:
        resolve_identity(str(path))
    assert "bad.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_binary_and_missing_files_are_refused(tmp_path):
    path = tmp_path / "bytes.json"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(HeadError, match="no JSON"):
        resolve_identity(str(path))
    with pytest.raises(HeadError, match="no such file"):
        resolve_identity(str(tmp_path / "none.json"))


@pytest.mark.parametrize("choice", ["nobody", "", "-1", "1.5", "99999999999", "../head.npz"])
def test_an_unknown_name_lists_the_known_ones(choice):
    with pytest.raises(HeadError, match="mean, ada"):
        resolve_identity(choice)
