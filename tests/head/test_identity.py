"""Names, seeds and files become coefficients, or one clear line."""

import json

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.head import load_builtin_head
from elocute.head.identity import identity_names, resolve_identity, sample_identity


def test_mean_is_zero():
    assert not resolve_identity("mean").any()


def test_eight_people_have_names():
    assert len(identity_names()) == 9
    faces = np.stack([resolve_identity(name) for name in identity_names()])
    assert faces.shape == (9, 77)
    apart = np.linalg.norm(faces[:, None] - faces[None], axis=2)
    assert apart[~np.eye(9, dtype=bool)].min() > 1.0


def test_a_seed_always_gives_the_same_face():
    assert np.array_equal(resolve_identity("42"), sample_identity(42))
    assert not np.array_equal(resolve_identity("42"), resolve_identity("43"))


def test_a_file_gives_its_numbers(tmp_path):
    numbers = np.linspace(-2, 2, 77)
    path = tmp_path / "me.json"
    path.write_text(json.dumps({"identity": numbers.tolist()}))
    assert np.allclose(resolve_identity(str(path)), numbers)


def test_a_file_of_the_first_versions_leaves_the_rest_at_zero(tmp_path):
    path = tmp_path / "me.json"
    path.write_text(json.dumps({"identity": [0.5] * 50}))
    assert np.array_equal(resolve_identity(str(path)), [0.5] * 50 + [0] * 27)


def test_seeds_are_women_and_men_of_all_ages():
    head = load_builtin_head()
    faces = np.stack([sample_identity(seed) for seed in range(200)])
    mean, slopes = head.trait_basis[:, 0], head.trait_basis[:, 1:]
    sex, years = mean[:, None] + slopes @ faces[:, :50].T
    assert 0.4 < (sex > 0.5).mean() < 0.6
    assert np.abs(sex - 0.5).min() > 0.4 and np.abs(sex - 0.5).max() < 0.7
    assert years.min() >= 19.9 and years.max() <= 72.1
    assert np.histogram(years, bins=[19, 33, 46, 59, 73])[0].min() > 30


def test_a_seed_changes_what_was_drawn_by_sex_age_and_tone_alone():
    head = load_builtin_head()
    drawn = np.random.default_rng(7).normal(0, 0.85, 77)
    common = np.vstack([head.tone_basis, head.trait_basis])[:, 1:]
    change = sample_identity(7) - np.clip(drawn, -2.5, 2.5)
    assert np.abs(change[50:]).max() < 1e-6
    left = change[:50] - np.linalg.pinv(common) @ (common @ change[:50])
    assert np.abs(left).max() < 1e-5


def test_random_faces_are_not_their_own_mirror_image():
    head = load_builtin_head()
    face = head.regions["face"]
    for seed in range(8):
        shape = head.identity_template(sample_identity(seed))
        apart = np.linalg.norm(shape - shape[head.mirror] * [-1, 1, 1], axis=1)[face]
        assert 0.1 < 1000 * apart.mean() < 1.5


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
