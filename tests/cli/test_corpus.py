"""`elocute corpus` as a person meets it."""

import json

import numpy as np
import pytest

from tests.support.commands import one_line, run_here


def run(*arguments):
    return run_here("corpus", *arguments)


def refused(*arguments, says=()):
    one_line(run(*arguments), *says)


@pytest.fixture
def folder(tmp_path, sources):
    """Three subjects in the convention of later work, and a corpus made of it."""
    sources.write_folder(tmp_path / "later", ("ann", "bob", "cy"))
    result = run("convert", tmp_path / "later", "-o", tmp_path / "corpus")
    assert result.returncode == 0, result.stderr
    return tmp_path / "corpus"


def test_convert_tells_what_it_did(tmp_path, sources):
    sources.write_folder(tmp_path / "later", ("ann", "bob", "cy"))
    (tmp_path / "later" / "wav" / "ann_e01.wav").unlink()
    (tmp_path / "names.txt").write_text("bob\ncy.e03\n")
    options = "-o", tmp_path / "corpus", "--fps", 15, "--leave-out", tmp_path / "names.txt"
    result = run("convert", tmp_path / "later", *options, "--json")
    record = json.loads(result.stdout)
    assert (record["clips"], record["subjects"], result.stderr) == (6, 3, "")
    assert "ann_e01: no sound" in record["notes"]
    told = json.loads(run("info", tmp_path / "corpus", "--json").stdout)
    assert (told["fps"], told["clips"], told["kind"]) == (15.0, 6, "vertices")


def test_info_shows_subjects_and_splits(folder):
    shown = run("info", folder).stdout
    assert "vertices     60" in shown and "ann" in shown and "train" in shown
    record = json.loads(run("info", folder, "--json").stdout)
    assert record["clips"] == 12 and set(record["subjects"]) == {"ann", "bob", "cy"}


def test_check_leaves_with_what_it_found(folder):
    result = run("check", folder)
    assert (result.returncode, result.stderr) == (0, ""), result.stdout
    assert "0 errors, 0 warnings in 12 clips" in result.stdout
    np.save(folder / "templates.npy", 1000 * np.load(folder / "templates.npy"))
    result = run("check", folder)
    assert result.returncode == 1 and result.stderr == ""
    assert "it fits a head in mm" in result.stdout
    record = json.loads(run("check", folder, "--json").stdout)
    assert record["errors"] == sum(f["level"] == "error" for f in record["findings"]) > 0


def test_bad_sources_are_refused_in_one_line(tmp_path, sources, folder):
    later = tmp_path / "later"
    (tmp_path / "theirs").mkdir()
    before = sorted(path.name for path in tmp_path.iterdir())
    output = "-o", tmp_path / "new"
    refused("convert", tmp_path / "none", *output, says=["no folder"])
    refused("convert", tmp_path, *output, says=["vocaset, biwi, folder, grid", "--format"])
    refused("convert", later, *output, "--format", "ply", says=["vocaset, biwi, folder, grid"])
    refused("convert", later, *output, "--format", "vocaset", says=["no data_verts.npy"])
    refused("convert", later, *output, "--format", "grid", says=["NAME.npz"])
    refused("convert", later, *output, "--format", "biwi", says=[".vl"])
    refused("convert", later, *output, "--fps", "nan", says=["no frame rate"])
    refused("convert", later, *output, "--leave-out", later, says=["a folder"])
    refused("convert", later, "-o", tmp_path / "theirs", says=["exists already"])
    refused("convert", later, "-o", tmp_path / "theirs", "--overwrite", says=["exists already"])
    refused("convert", later, "-o", later, says=["an input of this run"])
    refused("info", later, says=["corpus convert"])
    refused("check", tmp_path / "none", says=["corpus.json"])
    (later / "templates.pkl").write_bytes(b"cbuiltins\neval\n(S'1'\ntR.")
    refused("convert", later, *output, says=["builtins.eval"])
    (later / "templates.pkl").unlink()
    refused("convert", later, *output, says=["templates.pkl"])
    assert sorted(path.name for path in tmp_path.iterdir()) == before
