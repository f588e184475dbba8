"""Mesh sequences and vertex arrays."""

import numpy as np
import pytest
import trimesh

from elocute.errors import OutputError
from elocute.export.meshes import write_npy, write_obj, write_ply
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
