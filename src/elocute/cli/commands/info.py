"""`elocute info FILE`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from elocute.cli import options
from elocute.cli.characters import print_character
from elocute.errors import HeadError
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES

CURVE_SUFFIXES = (".csv", ".json", ".jsonl", ".npy")


def info_command(
    file: Path = typer.Argument(
        ...,
        help="A sound, a video, a motion (.npz), curves (.csv, .json, .npy), or a character "
        "(.glb, .gltf, .vrm, .fbx).",
    ),
    mesh: str | None = options.Mesh,
    as_json: bool = options.Json,
) -> None:
    """Describe a sound, a video, a motion, curves, or what of a character's shapes is moved."""
    if file.suffix.lower() in CHARACTER_SUFFIXES:
        print_character(file, mesh, as_json)
        return
    if mesh is not None:
        allowed = f"for {', '.join(CHARACTER_SUFFIXES)}"
        raise HeadError.about("--mesh", found=repr(mesh), allowed=allowed)
    facts = {".npz": _motion_facts}.get(file.suffix.lower(), _sound_facts)
    if file.suffix.lower() in CURVE_SUFFIXES:
        facts = _curve_facts
    record = facts(file)
    if as_json:
        print(json.dumps(record))
        return
    for name, value in record.items():
        shown = "; ".join(value) if isinstance(value, list) else value
        print(f"{name:12} {shown}")


def _motion_facts(file: Path) -> dict[str, Any]:
    from elocute.motion.store import load_motion

    motion = load_motion(file)
    moving = [
        name for name, column in zip(motion.names, motion.weights.T, strict=True) if column.any()
    ]
    return {
        "file": str(file),
        "kind": "motion",
        "frames": motion.frame_count,
        "fps": motion.fps,
        "duration_s": round(motion.duration_s, 4),
        "vertices": motion.head.vertex_count,
        "components": len(motion.names),
        "moving": ", ".join(moving) or "none",
        "rotations": motion.rotations is not None,
    }


def _curve_facts(file: Path) -> dict[str, Any]:
    from elocute.export.curve_files import read_curves

    file_curves = read_curves(file)
    curves = file_curves.curves
    moving = [name for name in curves.names if curves[name].any()]
    return {
        "file": str(file),
        "kind": "curves",
        "frames": len(curves.values),
        "fps": curves.fps,
        "duration_s": round(len(curves.values) / curves.fps, 4),
        "curves": len(curves.names),
        "moving": ", ".join(moving) or "none",
        **({"notes": "; ".join(file_curves.notes)} if file_curves.notes else {}),
    }


def _sound_facts(file: Path) -> dict[str, Any]:
    from elocute.audio.read import probe_audio

    record = asdict(probe_audio(file))
    tracks = record.pop("tracks")
    if tracks:
        record["tracks"] = [f"{number}: {track}" for number, track in enumerate(tracks)]
    return {"file": str(file), "kind": "sound", **record}
