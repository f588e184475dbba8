"""Speech blendshapes: what they hold, how they are compared, and the commands."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from elocute.capture.blendshapes.basis_comparison import (
    BasisProjection,
    reconstruction_errors,
    strongest_shapes,
)
from elocute.capture.blendshapes.blendshape_learning import BlendshapeConfig, learn_blendshapes
from elocute.capture.blendshapes.components import localise_components, principal_directions
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError, InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import PEOPLE
from elocute.motion.store import load_motion
from tests.support.commands import run_here


@pytest.fixture(scope="module")
def corpus(make_corpus: Callable[..., Corpus], tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("blendshapes") / "corpus")


@pytest.fixture(scope="module")
def train(corpus: Corpus) -> tuple[str, ...]:
    return corpus.split().train


def blocks_of(matrix: np.ndarray, size: int) -> list[np.ndarray]:
    return [matrix[start : start + size] for start in range(0, len(matrix), size)]


class TestPrincipalDirections:
    numbers = np.random.default_rng(0)
    matrix = numbers.normal(size=(700, 6)) @ numbers.normal(size=(6, 90)) * 0.001

    def test_are_singular_vectors_however_the_frames_are_cut(self) -> None:
        _, strengths, directions = np.linalg.svd(self.matrix, full_matrices=False)
        for size in (700, 64, 7):
            found = principal_directions(blocks_of(self.matrix, size), 6)
            np.testing.assert_allclose(found.strengths, strengths[:6], rtol=1e-4)
            cosines = np.abs((found.directions * directions[:6]).sum(axis=1))
            np.testing.assert_allclose(cosines, 1, atol=1e-4)

    def test_know_what_they_leave_out(self) -> None:
        found = principal_directions(blocks_of(self.matrix, 50), 3)
        assert found.frames == 700
        left = self.matrix - self.matrix @ found.directions.T @ found.directions
        share = 1 - np.square(left).sum() / np.square(self.matrix).sum()
        assert found.explained[-1] == pytest.approx(share, abs=1e-4)

    def test_of_nothing_are_none(self) -> None:
        assert len(principal_directions([], 5).strengths) == 0


def test_a_basis_represents_what_it_was_learned_from(
    corpus: Corpus, train: tuple[str, ...]
) -> None:
    learned = learn_blendshapes(corpus, train)
    basis = BasisProjection("speech", learned.head.expression_basis)
    assert reconstruction_errors(corpus, train, [basis])[0].errors_mm.max() < 0.01
    assert np.all(np.diff(learned.explained) >= 0) and learned.explained[-1] <= 1 + 1e-6
    assert learned.frames == sum(corpus.entry(name).frames for name in train)


def test_a_weight_of_one_is_one_deviation(corpus: Corpus, train: tuple[str, ...]) -> None:
    first = learn_blendshapes(corpus, train).head.expression_basis[0].ravel().astype(float)
    moved = np.concatenate([corpus.displacements(name) for name in train])
    weights = moved.reshape(len(moved), -1) @ first / (first @ first)
    assert np.sqrt(np.square(weights).mean()) == pytest.approx(1, rel=1e-3)


def test_signs_are_fixed(corpus: Corpus, train: tuple[str, ...]) -> None:
    for shape in learn_blendshapes(corpus, train).head.expression_basis.reshape(-1, 3 * 8842):
        most = int(np.abs(shape).argmax())
        assert shape[most] * (-1 if most % 3 == 1 else 1) > 0


def test_a_share_of_variance_chooses_the_count(corpus: Corpus, train: tuple[str, ...]) -> None:
    few = learn_blendshapes(corpus, train, BlendshapeConfig(None, 0.9))
    more = learn_blendshapes(corpus, train, BlendshapeConfig(None, 0.9999))
    assert few.explained[-1] >= 0.9 > few.explained[:-1].max(initial=0)
    assert len(more.explained) > len(few.explained)


def test_sparse_shapes_move_less_of_the_face(corpus: Corpus, train: tuple[str, ...]) -> None:
    def moving(sparsity: float) -> float:
        basis = learn_blendshapes(corpus, train, BlendshapeConfig(8, sparsity=sparsity)).head
        return float((np.abs(basis.expression_basis).max(axis=2) > 1e-7).mean())

    assert moving(0.3) < 0.7 * moving(0.0)


def test_without_sparsity_localised_components_span_the_principal_ones() -> None:
    matrix = np.random.default_rng(1).normal(size=(200, 30))
    found = principal_directions([matrix], 5)
    shapes, _ = localise_components(found, 5, 0.0)
    inside = shapes @ found.directions.T @ found.directions
    np.testing.assert_allclose(inside, shapes, atol=1e-3)


def test_speech_beats_as_many_general_shapes_on_held_out_people(
    corpus: Corpus, train: tuple[str, ...]
) -> None:
    parts, arkit = corpus.split(), load_builtin_head().expression_basis
    speech = learn_blendshapes(corpus, train, BlendshapeConfig(6)).head.expression_basis
    best = arkit[strongest_shapes(corpus, train, arkit, 6)]
    ours, theirs = reconstruction_errors(
        corpus,
        [*parts.validation, *parts.test],
        [BasisProjection("speech", speech), BasisProjection("arkit", best)],
    )
    assert ours.mean_mm < theirs.mean_mm
    assert len(ours.errors_mm) == len(theirs.errors_mm)


def test_another_topology_is_refused(corpus: Corpus, train: tuple[str, ...]) -> None:
    with pytest.raises(CorpusError, match="12 vertices"):
        reconstruction_errors(
            corpus, train, [BasisProjection("other", np.ones((2, 12, 3), np.float32))]
        )


@pytest.mark.parametrize("given", [{"components": 0}, {"variance": 1.5}, {"sparsity": 1.0}])
def test_settings_out_of_range_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(given))):
        BlendshapeConfig(**given)  # pyright: ignore[reportArgumentType]


def run(*arguments: object) -> tuple[int, str, str]:
    done = run_here("blendshapes", *arguments)
    return done.returncode, done.stdout, done.stderr


def test_commands_learn_compare_and_show(corpus: Corpus, tmp_path: Path) -> None:
    basis, folder = tmp_path / "speech.npz", corpus.folder
    code, out, err = run("learn", folder, "-o", basis, "--components", 5, "--json")
    assert code == 0, err
    assert json.loads(out)["components"] == 5
    learned = load_motion(basis).head
    assert learned.expression_names == tuple(f"speech0{n}" for n in range(5))
    assert learned.look == PEOPLE["mean"]

    report, plot = tmp_path / "report.json", tmp_path / "errors.png"
    code, out, err = run("compare", folder, basis, "-o", report, "--plot", plot)
    assert code == 0, err
    bases = json.loads(report.read_text())["bases"]
    assert bases["speech"]["mean_mm"] < bases["arkit, best 5"]["mean_mm"]
    assert plot.read_bytes()[:4] == b"\x89PNG"

    code, _, err = run("show", basis, "-o", tmp_path / "sheet.png", "--size", 256)
    assert code == 0, err
    assert run("learn", folder, "-o", tmp_path / "speech.glb", "--components", 3)[0] == 0
    assert (tmp_path / "speech.glb").read_bytes()[:4] == b"glTF"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["learn", "nowhere", "-o", "b.npz"], "corpus.json"),
        (["learn", "{corpus}", "-o", "b.xyz"], ".xyz"),
        (["learn", "{corpus}", "-o", "b.npz", "--part", "some"], "validation"),
        (["learn", "{corpus}", "-o", "b.npz", "--components", "3", "--variance", "0.9"], "one of"),
        (["show", "nowhere.npz", "-o", "s.png"], "no such file"),
        (["compare", "{corpus}", "nowhere.npz"], "no such file"),
    ],
)
def test_bad_input_is_one_line(
    corpus: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = run(*(word.format(corpus=corpus.folder) for word in arguments))
    assert code == 2
    assert told in err and err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_motion_is_told_with_its_clip(
    make_corpus: Callable[..., Corpus], tmp_path: Path, value: float
) -> None:
    """No solver gives up on it with an error of its own."""
    corpus = make_corpus(tmp_path / "corpus")
    names = corpus.split().train
    usual = corpus.displacements

    def broken(_: Corpus, name: str, *span: int) -> np.ndarray:
        block = usual(name, *span)
        if name == names[1]:
            block[0, 0, 0] = value
        return block

    with (
        mock.patch.object(Corpus, "displacements", broken),
        pytest.raises(CorpusError, match=f"clip {names[1]}: NaN or infinity in frame 0"),
    ):
        learn_blendshapes(corpus, names)
