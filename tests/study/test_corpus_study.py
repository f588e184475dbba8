"""Studies of a corpus, as VOCA's: recorded clips move the study's face, beside a model's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.motion.motion import Motion
from elocute.study.design.design_file import read_design
from elocute.study.design.trials import Clip
from elocute.study.stimuli.stimuli import ClipMaking, make_stimuli
from elocute.study.stimuli.stimulus_pictures import shown_motion
from tests.study.studies import HEAD

STUDIES = Path(__file__).parents[2] / "studies"
QUICK = """
[stimuli]
sounds = ["corpus/sound/{speaker}.s0.flac"]
identities = ["{face}"]
size = [96, 96]
fps = 10

[comparisons]
content = "same"

[qualification]
items = 0
right = 0

[catch]
every = 0
"""
BINARY = """
[[conditions]]
name = "recorded"
motion = "corpus"

[[conditions]]
name = "still"
motion = "corpus"
still = true
"""
STYLES = """
[[conditions]]
name = "plain"
motion = "corpus"
strength = 0.5

[[conditions]]
name = "broad"
motion = "corpus"

[[conditions]]
name = "recorded_plain"
motion = "corpus"
speaker = "plain"
reference_for = "plain"

[[conditions]]
name = "recorded_broad"
motion = "corpus"
speaker = "broad"
reference_for = "broad"
"""


def pictures(path: Path) -> np.ndarray:
    with av.open(str(path)) as file:
        return np.stack([each.to_ndarray(format="rgb24") for each in file.decode(video=0)])


@pytest.fixture(scope="module")
def corpora(tmp_path_factory: pytest.TempPathFactory, make_corpus) -> dict[str, Path]:
    """Folders with a corpus in each: of shapes' weights, and of vertices."""
    folders = {}
    for name in ("weights", "vertices"):
        folders[name] = tmp_path_factory.mktemp(name)
        make_corpus(folders[name] / "corpus", vertices=name == "vertices", fps=20.0)
    return folders


def shown(path: Path, data: Path, clip: Clip) -> tuple[ClipMaking, Motion]:
    """What a clip is made from, and its motion as it is shown."""
    made = ClipMaking(read_design(path), data, clip)
    voice = made.voice()
    source = replace(made.source, voice=made.moving_voice(voice))
    return made, shown_motion(source, made.times(voice.duration_s))


@pytest.mark.slow
def test_a_recorded_clip_moves_the_face_of_a_study(corpora, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(HEAD + BINARY + QUICK.format(speaker="broad", face="esi"))
    make_stimuli(path, tmp_path / "study", data=corpora["vertices"])
    seen = pictures(tmp_path / "study/pairs/recorded+still/broad-s0.esi.front.mp4").astype(int)
    moved = np.abs(np.diff(seen, axis=0)).mean((0, 1, 3))
    assert len(seen) == 15 and moved[:96].mean() > 3 * moved[96:].mean()
    # One face at rest on both sides, whoever was recorded: the eyes and above are alike.
    assert np.abs(seen[0, :40, :96] - seen[0, :40, 96:]).mean() < 3


@pytest.mark.slow
def test_weights_and_vertices_move_it_alike(corpora, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(HEAD + BINARY + QUICK.format(speaker="broad", face="esi"))
    clip = Clip("recorded", "broad-s0.esi.front")
    both = [shown(path, data, clip)[1] for data in corpora.values()]
    esi = load_builtin_head().with_identity(resolve_identity("esi"))
    assert all(np.allclose(each.head.template, esi.template) for each in both)
    one, other = (each.vertices() for each in both)
    assert np.abs(one - other).max() < 2e-4 < 2e-3 < np.abs(one - one[0]).max()


@pytest.mark.slow
def test_a_style_is_compared_with_a_recording_of_its_own_speaker(corpora, tmp_path):
    path = tmp_path / "study.toml"
    told = QUICK.format(speaker="tense", face="mean")
    path.write_text(HEAD.replace("binary", "style") + STYLES + told)
    made, motion = shown(path, corpora["weights"], Clip("recorded_plain", "tense-s0.mean.front"))
    assert made.heard_file.name == "plain.s0.flac" and motion.frame_count == 15
    made, _ = shown(path, corpora["weights"], Clip("plain", "tense-s0.mean.front"))
    assert made.heard_file.name == "tense.s0.flac"


@pytest.mark.parametrize("name", ["voca_binary", "voca_styles", "voca_ablation"])
def test_the_papers_studies_are_whole(name):
    design = read_design(STUDIES / f"{name}.toml")
    assert any(each.motion == "corpus" for each in design.conditions)


@pytest.mark.parametrize("name", ["voca_binary", "voca_ablation"])
def test_no_training_speaker_says_what_people_hear(name):
    """Of each test speaker's own last twenty sentences, five."""
    from recipes.corpus.sharing import FEW_EACH, share_sentences
    from recipes.corpus.subjects import SUBJECTS, TEST, VALIDATION

    spoken = share_sentences([each.style for each in SUBJECTS], (*VALIDATION, *TEST), seed=1)
    heard = [
        Path(each.file).stem.split(".")
        for each in read_design(STUDIES / f"{name}.toml").stimuli.sounds
    ]
    assert [speaker for speaker, _ in heard] == [each for each in TEST for _ in range(5)]
    for speaker, sentence in heard:
        number = int(sentence[1:])
        assert number in spoken[speaker][-FEW_EACH:]
        assert [each for each, said in spoken.items() if number in said] == [speaker]
