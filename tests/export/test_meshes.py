"""Mesh sequences and vertex arrays."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from elocute.errors import HeadError, OutputError
from elocute.export.identities import write_identities
from elocute.export.meshes import write_npy, write_obj, write_ply
from elocute.head.builtin import load_builtin_head
from elocute.meshes.mesh_file import read_mesh_file
from elocute.motion.motion import Motion


@pytest.fixture(scope="module")
def short(motion):
    return Motion(motion.head, motion.weights[30:36], motion.fps)


@pytest.mark.parametrize(("write", "suffix"), [(write_obj, ".obj"), (write_ply, ".ply")])
def test_each_frame_is_a_mesh_that_others_read(short, tmp_path, write, suffix):
    folder = tmp_path / f"talk{suffix}"
    write(short, folder)
    assert [p.name for p in sorted(folder.iterdir())] == [f"{i:05d}{suffix}" for i in range(6)]
    mesh = trimesh.load_mesh(folder / f"00004{suffix}", process=False)
    assert np.allclose(mesh.vertices, short.vertices(4, 5)[0], atol=2e-6)
    assert len(mesh.faces) == len(short.head.triangles)


@pytest.fixture(scope="module")
def short_dressed(dressed):
    return Motion(dressed.head, dressed.weights[30:32], dressed.fps)


def test_an_obj_names_its_images(short_dressed, tmp_path):
    write_obj(short_dressed, tmp_path / "talk.obj")
    names = {p.name for p in (tmp_path / "talk.obj").iterdir()}
    assert names == {
        *("00000.obj", "00001.obj", "materials.mtl", "skin.jpg", "skin_normal.png", "lips.jpg"),
        *("teeth.png", "teeth_alpha.png", "hair.png", "hair_alpha.png"),
    }
    library = (tmp_path / "talk.obj" / "materials.mtl").read_text()
    assert library.count("newmtl ") == len(short_dressed.head.material_names)
    assert "map_Kd skin.jpg" in library and "norm skin_normal.png" in library
    scene = trimesh.load_scene(tmp_path / "talk.obj" / "00001.obj", process=False)
    meshes: list[Any] = list(scene.geometry.values())
    drawn = {mesh.visual.material.name: mesh for mesh in meshes}
    head = short_dressed.head
    assert set(drawn) == {head.material_names[i] for i in np.unique(head.material)}
    assert sum(len(mesh.faces) for mesh in drawn.values()) == len(head.triangles)
    skin = drawn["skin"]
    assert skin.visual.material.image.size == (32, 32)
    chosen = head.triangle_material == head.material_names.index("skin")
    points = short_dressed.vertices(1, 2)[0][head.triangles[chosen]].reshape(-1, 3)
    places = head.uv[head.uv_triangles[chosen]].reshape(-1, 2)
    corners = skin.faces.ravel()
    assert _same_rows(
        np.hstack([skin.vertices[corners], skin.visual.uv[corners]]), np.hstack([points, places])
    )


def _same_rows(one, other):
    """Whether each row of one is a row of the other, to six digits."""
    from scipy.spatial import KDTree

    pairs = ((one, other), (other, one))
    return all(KDTree(rows).query(more)[0].max() < 5e-6 for rows, more in pairs)


def test_a_ply_names_its_images(short_dressed, tmp_path):
    write_ply(short_dressed, tmp_path / "talk.ply")
    names = {p.name for p in (tmp_path / "talk.ply").iterdir()}
    assert names == {*("00000.ply", "00001.ply"), "skin.jpg", "lips.jpg", "teeth.png", "hair.png"}
    data = (tmp_path / "talk.ply" / "00001.ply").read_bytes()
    header = data[: data.index(b"end_header")].decode()
    found = [line.split()[-1] for line in header.splitlines() if "TextureFile" in line]
    assert found == ["skin.jpg", "lips.jpg", "teeth.png", "hair.png"]
    mesh: Any = trimesh.load_mesh(tmp_path / "talk.ply" / "00001.ply", process=False)
    head = short_dressed.head
    points = short_dressed.vertices(1, 2)[0][head.triangles].reshape(-1, 3)
    places = head.uv[head.uv_triangles].reshape(-1, 2)
    corners = mesh.faces.ravel()
    assert _same_rows(
        np.hstack([mesh.vertices[corners], mesh.visual.uv[corners]]), np.hstack([points, places])
    )


@pytest.mark.parametrize(("write", "suffix"), [(write_obj, ".obj"), (write_ply, ".ply")])
def test_our_own_reader_gets_the_same_topology_back(short_dressed, tmp_path, write, suffix):
    write(short_dressed, tmp_path / f"talk{suffix}")
    path = tmp_path / f"talk{suffix}" / f"00001{suffix}"
    parts = read_mesh_file(path, max_bytes=50_000_000, error=HeadError)
    assert np.allclose(parts.vertices, short_dressed.vertices(1, 2)[0], atol=2e-6)
    assert np.array_equal(
        np.sort(parts.triangles, axis=1), np.sort(short_dressed.head.triangles, axis=1)
    )


def test_faces_that_share_images_share_their_files(short_dressed, tmp_path):
    head = load_builtin_head()
    clad = replace(head, surfaces=short_dressed.head.surfaces)
    write_identities(clad, np.zeros((3, 2), np.float32), tmp_path / "people.obj")
    assert len(list((tmp_path / "people.obj").glob("*.mtl"))) == 1
    assert len(list((tmp_path / "people.obj").glob("skin.*"))) == 1


def test_an_existing_folder_is_refused_and_kept(short, tmp_path):
    folder = tmp_path / "talk.obj"
    folder.mkdir()
    (folder / "mine.txt").write_text("precious")
    with pytest.raises(OutputError, match="exists already"):
        write_obj(short, folder)
    assert (folder / "mine.txt").read_text() == "precious"


def test_npy_holds_every_vertex(short, tmp_path):
    write_npy(short, tmp_path / "talk.npy")
    array = np.load(tmp_path / "talk.npy", mmap_mode="r", allow_pickle=False)
    assert array.shape == (6, short.head.vertex_count, 3) and array.dtype == np.float32
    assert np.array_equal(array, short.vertices())


def test_an_interrupted_sequence_leaves_nothing(short, tmp_path):
    def stop(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_obj(short, tmp_path / "talk.obj", progress=stop)
    assert list(tmp_path.iterdir()) == []
