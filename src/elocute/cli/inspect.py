"""`elocute info FILE`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from elocute.cli import options


def info_command(
    file: Path = typer.Argument(..., help="A sound, a video, or a motion (.npz)."),
    as_json: bool = options.Json,
) -> None:
    """Say what a file holds."""
    record = _motion_facts(file) if file.suffix.lower() == ".npz" else _sound_facts(file)
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


def _sound_facts(file: Path) -> dict[str, Any]:
    from elocute.audio.read import probe_audio

    return {"file": str(file), "kind": "sound", **asdict(probe_audio(file))}
