"""Folders of long work: ours is gone on in, and a stranger's is left as it is."""

from collections.abc import Callable
from pathlib import Path

import pytest

from elocute.errors import OutputError
from elocute.files.work_folder import prepare_trainings, prepare_work
from elocute.propagation.corpus_propagation import WRITTEN


@pytest.mark.parametrize("name", ["manifest.json", "basis.npz", "rejects.csv", "one.parquet"])
def test_propagate_goes_on_in_its_own_folder_only(tmp_path: Path, name: str):
    (tmp_path / name).write_text("mine")
    with pytest.raises(OutputError, match="there is no records beside it"):
        prepare_work(tmp_path, True, "records", WRITTEN)
    (tmp_path / "records").mkdir()
    prepare_work(tmp_path, True, "records", WRITTEN)
    assert (tmp_path / name).read_text() == "mine"


@pytest.mark.parametrize("name", ["report.json", "speaker/model.onnx", "word/log.csv"])
def test_trainings_go_on_in_their_own_folder_only(tmp_path: Path, name: str):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")
    with pytest.raises(OutputError, match="safetensors beside it"):
        prepare_trainings(tmp_path, ("speaker", "word"), True)
    assert path.read_text() == "mine"


def test_trainings_that_were_broken_off(tmp_path: Path):
    for name in ("speaker/checkpoint.safetensors", "speaker/log.csv", "notes.txt", "report.json"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    prepare_trainings(tmp_path, ("speaker", "word"), True)


def test_a_format_beside_a_file_name(
    refused: Callable[..., None], speech_wav: Path, tmp_path: Path
):
    for name in ("talk.glb", "talk.npz"):
        refused(
            "animate",
            speech_wav,
            "-o",
            tmp_path / name,
            "--format",
            "csv",
            says="--format with a folder",
        )
    assert not list(tmp_path.iterdir())
