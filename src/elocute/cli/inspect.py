"""`elocute info FILE` and `elocute doctor`."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from elocute.cli import options

LIBRARIES = ("numpy", "onnxruntime", "soundfile", "soxr", "av", "pillow", "moderngl", "embreex")


def info_command(
    file: Path = typer.Argument(..., help="A sound, a video, a motion (.npz) or curves (.json)."),
    as_json: bool = options.Json,
) -> None:
    """Say what a file holds."""
    facts = {".npz": _motion_facts, ".json": _curve_facts}.get(file.suffix.lower(), _sound_facts)
    record = facts(file)
    if as_json:
        print(json.dumps(record))
        return
    for name, value in record.items():
        print(f"{name:12} {value}")


def _motion_facts(file: Path) -> dict[str, Any]:
    from elocute.motion.store import load_motion

    motion = load_motion(file)
    moving = [
        name for name, column in zip(motion.names, motion.weights.T, strict=True) if column.any()
    ]
    return {
        "file": str(file), "kind": "motion", "frames": motion.frame_count, "fps": motion.fps,
        "duration_s": round(motion.duration_s, 4), "vertices": motion.head.vertex_count,
        "components": len(motion.names), "moving": ", ".join(moving) or "none",
        "rotations": motion.rotations is not None,
    }  # fmt: skip


def _curve_facts(file: Path) -> dict[str, Any]:
    from elocute.export.curves_json import read_json_curves

    curves = read_json_curves(file)
    moving = [name for name in curves.names if curves[name].any()]
    return {
        "file": str(file), "kind": "curves", "frames": len(curves.values), "fps": curves.fps,
        "duration_s": round(len(curves.values) / curves.fps, 4), "curves": len(curves.names),
        "moving": ", ".join(moving) or "none",
    }  # fmt: skip


def _sound_facts(file: Path) -> dict[str, Any]:
    from elocute.audio.read import probe_audio

    return {"file": str(file), "kind": "sound", **asdict(probe_audio(file))}


def doctor_command(as_json: bool = options.Json) -> None:
    """Say what is installed, which renderer works, and where assets lie."""
    from elocute._version import __version__
    from elocute.encoders.phone_encoder import BUILTIN_PATH
    from elocute.export.render import available_backends
    from elocute.head.builtin import BUILTIN_HEAD_PATH

    record: dict[str, Any] = {
        "elocute": __version__,
        "python": f"{platform.python_version()} on {platform.system()} {platform.machine()}",
        **{name: _version(name) for name in LIBRARIES},
        **{f"renderer {name}": state for name, state in available_backends().items()},
        "head": _asset(BUILTIN_HEAD_PATH),
        "encoder": _asset(BUILTIN_PATH),
        "viewer": _asset(Path(str(BUILTIN_HEAD_PATH)).parents[2] / "export/assets/viewer.js"),
    }
    if as_json:
        print(json.dumps(record))
        return
    for name, value in record.items():
        print(f"{name:18} {value}")


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "missing: pip install --force-reinstall elocute"


def _asset(path: Path) -> str:
    return f"{path} ({path.stat().st_size / 1e6:.1f} MB)" if path.is_file() else f"{path} missing"
