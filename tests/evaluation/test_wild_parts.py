"""Which clips the experiments in the wild train and are measured on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("pyarrow")

from elocute.corpus.shards import Shards, open_shards, shard_writer
from elocute.errors import CorpusError, InputError
from elocute.evaluation.wild_parts import (
    exact_parameters,
    experiment_clips,
    read_held_out,
)
from elocute.evaluation.wild_scores import score_carried
from elocute.training.crnn.feature_cache import FeatureCache, cache_features
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.crnn.training_data import training_clips
from tests.support.commands import succeeds


@pytest.fixture(scope="module")
def propagated(speech_shards: Shards, tmp_path_factory: pytest.TempPathFactory) -> Shards:
    """Every third clip of training and test is a captured speaker's own."""
    folder = tmp_path_factory.mktemp("propagated") / "shards"
    owner = {"train": "a", "test": "b"}
    with shard_writer(folder, speech_shards.basis) as writer:
        for number, clip in enumerate(speech_shards.clips()):
            if number % 3 == 0 and clip.split in owner:
                clip = replace(clip, speaker=owner[clip.split], source=owner[clip.split])
            writer.add(clip)
    return open_shards(folder, speech_shards.sound_root)


@pytest.fixture(scope="module")
def exact(propagated: Shards, tmp_path_factory: pytest.TempPathFactory) -> Shards:
    """Half as far, of the test part alone."""
    folder = tmp_path_factory.mktemp("exact") / "shards"
    with shard_writer(folder, propagated.basis) as writer:
        for clip in propagated.clips("test"):
            writer.add(replace(clip, parameters=clip.parameters / 2))
    return open_shards(folder, propagated.sound_root)


@pytest.fixture(scope="module")
def features(propagated: Shards, tmp_path_factory: pytest.TempPathFactory) -> FeatureCache:
    return cache_features(propagated, tmp_path_factory.mktemp("features"))


def test_the_paper_learns_from_what_was_carried_over_alone(features: FeatureCache) -> None:
    ours, paper = CrnnTrainConfig(), CrnnTrainConfig.preset("paper")
    assert {row.carried for row in training_clips(features, ours)} == {True, False}
    found = experiment_clips(features, "speaker", paper)
    assert all(row.carried and row.split == "train" for row in found.train)
    assert set(found.measured) == {"validation", "test", "source", "participant"}
    assert {row.speaker for row in found.measured["test"]} == {"tester"}
    assert {row.speaker for row in found.measured["participant"]} == {"b"}
    own = found.measured["source"]
    assert {(row.speaker, row.split) for row in own} == {("a", "train")}
    assert not {row.clip for row in own} & {row.clip for row in found.train}
    assert "source" not in experiment_clips(features, "speaker", ours).measured, "it learns them"


def test_held_out_words_are_those_of_the_file(features: FeatureCache, tmp_path: Path) -> None:
    path = tmp_path / "split.json"
    path.write_text(json.dumps({"words": {"train": ["word0"], "held_out": ["word1", "word2"]}}))
    held = read_held_out(path)
    found = experiment_clips(features, "word", CrnnTrainConfig(), held)
    assert {row.word for row in found.train} == {"word0", "word3"}
    for part, rows in found.measured.items():
        assert rows and {row.word for row in rows} <= {"word1", "word2"}, part
    with pytest.raises(CorpusError, match="no clip in validation"):
        experiment_clips(features, "word", CrnnTrainConfig(), ["unheard"])
    for text in ("{}", '{"words": []}', '{"words": {"held_out": []}}', "[]"):
        path.write_text(text)
        with pytest.raises(InputError, match="held_out"):
            read_held_out(path)


def test_exact_parameters_are_those_of_the_same_clips(
    propagated: Shards, exact: Shards, features: FeatureCache, speech_shards: Shards, tmp_path: Path
) -> None:
    known = exact_parameters(propagated, exact, 30.0)
    clips = experiment_clips(features, "speaker", CrnnTrainConfig())
    shares = np.ones(propagated.components, np.float32)
    table = score_carried(features, "speaker", clips, known, shares)
    assert set(table) == {"carried, speaker test"}
    found = table["carried, speaker test"]
    assert found.clips == len(clips.measured["test"]) and 0 < found.mean.value < 0.95
    same = score_carried(
        features, "speaker", clips, exact_parameters(propagated, propagated, 30.0), shares
    )
    assert same["carried, speaker train"].weighted.value > 0.8  # shapes that never move count 0
    basis = speech_shards.basis
    shapes = replace(basis.head, expression_basis=2 * basis.head.expression_basis)
    with shard_writer(tmp_path / "other", replace(basis, head=shapes)) as writer:
        for clip in propagated.clips("test"):
            writer.add(clip)
    other = open_shards(tmp_path / "other", propagated.sound_root)
    with pytest.raises(CorpusError, match="another basis"):
        exact_parameters(propagated, other, 30.0)


def test_the_command_tells_both(propagated: Shards, exact: Shards, tmp_path: Path) -> None:
    split = tmp_path / "split.json"
    split.write_text(json.dumps({"words": {"held_out": ["word1", "word2"]}}))
    given = ("evaluate", "wild", propagated.folder, propagated.sound_root, "-o", tmp_path / "w")
    given = (*given, "--exact", exact.folder, "--held-out", split, "--preset", "paper")
    told = succeeds(*given, "--trainings", "speaker,word", "--epochs", 1, "--json").stdout
    report = json.loads(told)
    rows = report["concordance"]
    assert {
        "speaker source",
        "speaker participant",
        "speaker test, exact",
        "word test, exact",
    } <= set(rows)
    assert "word validation, exact" not in rows
    assert rows["word test"]["clips"] < rows["speaker test"]["clips"]
    assert report["paper"]["speaker source"] == 0.621
    assert report["config"]["weight_power"] == 1 and not report["config"]["captured"]
