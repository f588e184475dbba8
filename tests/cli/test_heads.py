"""`elocute head` as a person meets it."""

import json
import os
import pickle

import numpy as np
import pytest
import trimesh
from PIL import Image

from elocute.head import resolve_identity
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import dressed, person
from elocute.head.registry import open_head
from elocute.render import open_renderer, portrait
from tests.support.commands import one_line, run_apart, run_here


def run(*arguments):
    return run_here("head", *arguments)


def refused(*arguments, says=()):
    one_line(run(*arguments), *says)


@pytest.fixture(scope="module")
def flame(python2, tmp_path_factory):
    path = tmp_path_factory.mktemp("flame") / "generic_model.pkl"
    path.write_bytes(python2.dumps(python2.flame(vertices=300)))
    return path


def test_show_says_what_a_flame_file_holds(flame):
    record = json.loads(run("show", flame, "--json").stdout)
    assert (record["vertices"], record["faces"]) == (300, 600)
    assert (record["identities"], record["expressions"]) == (300, 100)
    assert record["joints"] == ["root", "neck", "jaw", "eyeLeft", "eyeRight"]
    assert record["landmarks"] is False
    shown = run("show", flame).stdout
    assert "landmarks     no" in shown and "root, neck, jaw" in shown


def test_a_process_of_its_own_shows_the_same(flame):
    result = run_apart("head", "show", flame, check=True)
    assert result.stdout == run("show", flame).stdout and result.stderr == ""


def test_show_knows_the_builtin_head():
    record = json.loads(run("show", "builtin", "--json").stdout)
    assert (record["identities"], record["expressions"]) == (77, 55)
    assert record["landmarks"] is True and record["lips"] is True


@pytest.mark.parametrize("mesh", ["obj", "ply"])
def test_samples_are_meshes_that_a_seed_repeats(flame, tmp_path, mesh):
    options = "--head", flame, "--format", mesh
    assert run("sample", "--count", 3, "--seed", 7, "-o", tmp_path / "a", *options).stderr == ""
    assert run("sample", "--count", 2, "--seed", 7, "-o", tmp_path / "b", *options).stderr == ""
    run("sample", "--count", 1, "--seed", 9, "-o", tmp_path / "c", *options)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == [f"0000{number}.{mesh}" for number in (7, 8, 9)]
    first, second, third = (tmp_path / "a" / name for name in names)
    assert first.read_bytes() == (tmp_path / "b" / names[0]).read_bytes()
    assert second.read_bytes() == (tmp_path / "b" / names[1]).read_bytes()
    assert third.read_bytes() == (tmp_path / "c" / names[2]).read_bytes()
    assert len({path.read_bytes() for path in (first, second, third)}) == 3
    loaded = trimesh.load_mesh(first, process=False)
    assert len(loaded.vertices) == 300 and len(loaded.faces) == 600


def test_the_suffix_of_a_folder_chooses_too(tmp_path):
    result = run("sample", "--count", 2, "-o", tmp_path / "people.ply", "--json")
    record = json.loads(result.stdout)
    assert (record["head"], record["count"]) == ("elocute", 2)
    people = [
        trimesh.load_mesh(p, process=False) for p in sorted((tmp_path / "people.ply").iterdir())
    ]
    moved = np.linalg.norm(people[0].vertices - people[1].vertices, axis=1)
    assert 0.001 < moved.mean() < 0.05


def test_faces_are_numbered_by_what_identity_takes(flame, tmp_path):
    run("sample", "--count", 2, "--seed", 6, "-o", tmp_path / "people")
    run("sample", "--count", 2, "--seed", 6, "--head", flame, "-o", tmp_path / "others")
    heads = {"people": None, "others": open_head(str(flame))}
    for folder, head in heads.items():
        face = resolve_identity("7", head)
        wanted = (head or load_builtin_head()).with_identity(face).template
        mesh = trimesh.load_mesh(tmp_path / folder / "00007.obj", process=False)
        assert np.abs(mesh.vertices - wanted).max() < 1e-5


def test_a_sheet_shows_people(tmp_path):
    """Somebody's own shirt and hair, not a bust."""
    run("sample", "--count", 1, "--seed", 7, "-o", tmp_path / "sheet.png", "--size", 256)
    one, view = dressed(person("7")), portrait(load_builtin_head())
    with open_renderer(one, (102, 102), camera=view) as renderer:
        wanted = renderer.frame(one.template).astype(int)
    with Image.open(tmp_path / "sheet.png") as picture:
        found = np.asarray(picture.convert("RGB"))[:, :, :3].astype(int)
    assert np.abs(found[20:] - wanted[20:]).mean() < 1


@pytest.mark.slow
@pytest.mark.parametrize("chosen", ["builtin", "flame"])
def test_a_sheet_shows_every_face(flame, tmp_path, chosen):
    head = flame if chosen == "flame" else chosen
    sheet = tmp_path / "sheet.png"
    result = run(
        "sample", "--count", 7, "-o", sheet, "--head", head, "--size", 160, "--backend", "embreex"
    )
    assert result.returncode == 0, result.stderr
    with Image.open(sheet) as picture:
        assert picture.size == (5 * 64, 2 * 64)
        tiles = np.asarray(picture).reshape(2, 64, 5, 64, 3).swapaxes(1, 2)[:, :, 20:]
    assert tiles[0, 0].std() > 5 and not np.array_equal(tiles[0, 0], tiles[0, 1])


class TestRefusals:
    def test_no_such_head(self, tmp_path):
        refused("show", "nobody", says=["nobody", "builtin", ".pkl"])
        refused("show", tmp_path / "no.pkl", says=["no.pkl", "no such file"])
        refused("show", tmp_path / "no.npz", says=["no.npz"])
        refused("sample", "--head", "a.obj", "-o", tmp_path / "x", says=["a.obj"])
        assert list(tmp_path.iterdir()) == []

    def test_a_payload_never_runs(self, tmp_path):
        marker = tmp_path / "marker"

        class Payload:
            def __reduce__(self):
                return os.system, (f"touch {marker}",)

        path = tmp_path / "model.pkl"
        path.write_bytes(pickle.dumps({"v_template": Payload()}))
        refused("show", path, says=["found the global posix.system", "allowed: chumpy.ch.Ch"])
        refused("sample", "--head", path, "-o", tmp_path / "x", says=["posix.system"])
        assert not marker.exists()

    def test_files_that_are_no_model(self, flame, tmp_path):
        path = tmp_path / "model.pkl"
        for data in (b"", b"hello", flame.read_bytes()[:5000], pickle.dumps({"a": 1})):
            path.write_bytes(data)
            refused("show", path, says=["model.pkl"])

    @pytest.mark.parametrize(
        ("options", "word"),
        [
            (["--count", "0"], "count"),
            (["--count", "many"], "count"),
            (["--seed", "-1"], "seed"),
            (["--format", "stl"], ".obj .ply"),
            (["--size", "huge"], "--size"),
        ],
    )
    def test_options_that_make_no_sense(self, tmp_path, options, word):
        refused("sample", "-o", tmp_path / "x", *options, says=[word])
        assert list(tmp_path.iterdir()) == []

    def test_places_that_cannot_be_written(self, tmp_path):
        refused("sample", "-o", tmp_path / "x.jpg", says=["'.jpg'", ".png"])
        refused("sample", "-o", tmp_path / "no" / "x.png", says=["mkdir"])
        refused("sample", "-o", tmp_path, says=["exists already"])
        refused("sample", "-o", tmp_path / "x.png", "--count", "1000", says=["up to 200"])
        refused("sample", "-o", tmp_path / "x.png", "--backend", "crayon", says=["crayon"])
        refused("sample", says=["output"])
        assert list(tmp_path.iterdir()) == []
