"""Meshes, scans with textures, FLAME and other pickles, .vl."""

from __future__ import annotations

import contextlib
import warnings
from pathlib import Path

import numpy as np

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers.one_file import only


def _flame(path: Path) -> None:
    from elocute.head.registry import open_head

    head = open_head(path)
    _ = head.triangles, head.with_identity(np.ones(len(head.identity_basis), np.float32))


def _flame_parameters(path: Path) -> None:
    from elocute.head.flame_parameters import load_flame_parameters

    load_flame_parameters(path)


def _flame_layout(path: Path) -> None:
    from elocute.errors import ElocuteWarning
    from elocute.head.flame_layouts import read_layout

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ElocuteWarning)  # lost frames are told
        read_layout(path)


def _mesh(path: Path) -> None:
    from elocute.head.registry import open_head

    _ = open_head(path).triangles


def _character(folder: Path, out: Path) -> None:
    from elocute.adoption.characters.open_character import character_head, open_character
    from elocute.adoption.characters.report import character_record, report_lines
    from elocute.export.gltf_character import character_glb
    from elocute.motion.motion import Motion

    opened = open_character(next(iter(folder.iterdir())))
    assert list(report_lines(character_record(opened)))
    head = character_head(opened.character)
    weights = np.full((2, len(head.expression_names)), 0.3, np.float32)
    turns = np.tile(np.array([0.8, 0.6, 0, 0], np.float32), (2, len(head.joint_names), 1))
    made = character_glb(Motion(head, weights, 30, turns), opened.character)
    written = out / "face.glb"
    written.write_bytes(made)
    open_character(written)  # what was written is a file of its kind


def _scan(folder: Path, _out: Path) -> None:
    from elocute.errors import CaptureError
    from elocute.registration.scan import checked_scan
    from elocute.registration.scan_file import read_scan

    path = next(path for path in folder.iterdir() if path.suffix in (".ply", ".obj", ".stl"))
    scan = read_scan(path)
    with contextlib.suppress(CaptureError):  # none of the seeds has points enough
        checked_scan(scan)


def _surface(path: Path) -> None:
    from elocute.errors import HeadError
    from elocute.meshes.parts import read_mesh_parts

    for part in read_mesh_parts(path, max_bytes=100_000_000, error=HeadError):
        assert np.isfinite(part.vertices).all() and part.triangles.max() < len(part.vertices)


def _pickle(path: Path) -> None:
    from elocute.files.pickles.closed_pickle import read_pickle

    read_pickle(path)


def _vl(path: Path) -> None:
    from elocute.corpus.importers.biwi import read_vl

    read_vl(path)


def _vl_seed(folder: Path) -> None:
    data = np.int32(4).tobytes() + np.arange(12, dtype="<f4").tobytes()
    (seeds.place(folder, "one") / "frame_001.vl").write_bytes(data)


READERS: tuple[Reader, ...] = (
    Reader(
        "scan",
        seeds.scans,
        _scan,
        {"*.ply": "ply", "*.obj": "text", "*.mtl": "text", "*.png": "png", "*.stl": "bytes"},
        ("elocute.registration.scan", "elocute.registration.scan_file"),
        short=150,
    ),
    Reader(
        "mesh",
        seeds.meshes,
        only(_mesh),
        {"*.ply": "ply", "*.obj": "text"},
        ("elocute.head.registry",),
        short=150,
    ),
    Reader(
        "character",
        seeds.characters,
        _character,
        {"*.glb": "glb", "*.vrm": "glb", "*.gltf": "json"},
        ("elocute.adoption.characters.open_character", "elocute.export.gltf_character"),
    ),
    Reader(
        "surface",
        seeds.surfaces,
        only(_surface),
        {"*.glb": "glb"},
        ("elocute.meshes.parts", "elocute.meshes.gltf_meshes", "elocute.meshes.meshopt"),
        short=150,
    ),
    Reader(
        "flame",
        seeds.flame,
        only(_flame),
        {"*.pkl": "pickle"},
        ("elocute.head.registry",),
        short=150,
        needs=("scipy",),
    ),
    Reader(
        "flame parameters",
        seeds.flame_parameters,
        only(_flame_parameters),
        {"*.npz": "npz"},
        ("elocute.head.flame_parameters",),
    ),
    Reader(
        "flame layout",
        seeds.flame_layouts,
        only(_flame_layout),
        {"*.npz": "npz"},
        ("elocute.head.flame_layouts",),
    ),
    Reader(
        "pickle",
        seeds.pickles,
        only(_pickle),
        {"*.pkl": "pickle"},
        ("elocute.files.pickles.closed_pickle",),
        needs=("scipy",),
    ),
    Reader(
        "vl",
        lambda folder: _vl_seed(folder),
        only(_vl),
        {"*.vl": "vl"},
        ("elocute.corpus.importers.biwi",),
    ),
    Reader(
        "texture",
        seeds.textures,
        _scan,
        {"skin.png": "png", "skin.*": "bytes"},
        ("elocute.registration.scan", "elocute.registration.scan_file"),
        short=100,
    ),
)
