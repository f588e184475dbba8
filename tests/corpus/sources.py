"""Tiny corpora in the very formats that VOCASET, BIWI and later work are distributed in."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import soundfile

RATE = 22050


def head_points(vertices: int, seed: int = 0) -> np.ndarray:
    """A ball of vertices as large as a head, in metres."""
    points = np.random.default_rng(seed).normal(size=(vertices, 3))
    return (0.12 * points / np.linalg.norm(points, axis=1, keepdims=True)).astype(np.float32)


def talk(template: np.ndarray, frames: int, seed: int = 0) -> np.ndarray:
    """(frame, vertex, 3): the lowest vertices go up and down."""
    low = np.argsort(template[:, 1])[: len(template) // 10]
    motion = np.repeat(template[None], frames, axis=0)
    wave = np.sin(np.arange(frames) / 5 + seed)
    depth = 0.03 * np.ptp(template)
    motion[:, low, 1] -= (depth * np.abs(wave)[:, None]).astype(motion.dtype)
    return motion


def resolve_speech(frames: int, fps: float, seed: int = 0) -> np.ndarray:
    """int16 (sample,) noise that lasts as long as the frames."""
    noise = np.random.default_rng(seed).normal(0, 3000, round(frames / fps * RATE))
    return noise.clip(-32768, 32767).astype(np.int16)


def write_vocaset(
    folder: Path, python2: Any, subjects: tuple[str, ...], sentences: tuple[int, ...] = (1, 21, 40)
) -> dict[str, Any]:
    """Everything as distributed, 20 frames a sentence; returns what was written."""
    folder.mkdir()
    templates = {name: head_points(5023, i).astype(float) for i, name in enumerate(subjects)}
    rows, sounds, vertices, at = {}, {}, [], 0
    for i, name in enumerate(subjects):
        rows[name], sounds[name] = {}, {}
        for number in sentences:
            key = f"sentence{number:02}"
            vertices.append(talk(templates[name].astype(np.float32), 20, number + i))
            rows[name][key] = {frame: at + frame for frame in range(20)}
            sounds[name][key] = {"audio": resolve_speech(20, 60, number), "sample_rate": RATE}
            at += 20
    stacked = np.concatenate(vertices)
    np.save(folder / "data_verts.npy", stacked)
    pickles = {"raw_audio_fixed": sounds, "templates": templates, "subj_seq_to_idx": rows}
    for name, item in pickles.items():
        (folder / f"{name}.pkl").write_bytes(python2.dumps(item))
    return {"vertices": stacked, "rows": rows, "sounds": sounds, "templates": templates}


def write_folder(folder: Path, subjects: tuple[str, ...], vertices: int = 60) -> None:
    """Four sentences a subject, flat arrays, templates in millimetres, pickled by Python 3."""
    for part in ("vertices_npy", "wav"):
        (folder / part).mkdir(parents=True)
    templates = {name: 1000 * head_points(vertices, i) for i, name in enumerate(subjects)}
    (folder / "templates.pkl").write_bytes(pickle.dumps(templates))
    for name, template in templates.items():
        for number in range(4):
            stem = f"{name}_e{number:02}"
            frames = talk(template, 15, number).reshape(15, -1)
            np.save(folder / "vertices_npy" / f"{stem}.npy", frames)
            soundfile.write(folder / "wav" / f"{stem}.wav", resolve_speech(15, 30, number), RATE)


def write_prepared_biwi(folder: Path, clips: tuple[str, ...], fps: float = 25.0) -> None:
    """BIWI as FaceFormer and CodeTalker keep it: SUBJECT_SENTENCE, each mesh centred and scaled
    to a surface of about 1, so that a head is about as high as 1; five frames a clip."""
    for part in ("vertices_npy", "wav"):
        (folder / part).mkdir(parents=True)
    subjects = dict.fromkeys(clip.split("_")[0] for clip in clips)
    size = np.array([3.5, 4.2, 3.0], np.float32)
    templates = {name: size * head_points(23370, i) for i, name in enumerate(subjects)}
    (folder / "templates.pkl").write_bytes(pickle.dumps(templates))
    for clip in clips:
        frames = talk(templates[clip.split("_")[0]], 5).reshape(5, -1)
        np.save(folder / "vertices_npy" / f"{clip}.npy", frames)
        soundfile.write(folder / "wav" / f"{clip}.wav", resolve_speech(5, fps), RATE)


def write_biwi(folder: Path, subjects: tuple[str, ...], vertices: int = 50) -> None:
    """Two sentences a subject of 10 frames, centimetres, faces that look along -Z, y down."""
    for i, name in enumerate(subjects):
        template = 100 * head_points(vertices, i)
        scans = folder / "rigid_scans"
        scans.mkdir(parents=True, exist_ok=True)
        front = template[:3].copy()
        winding = (
            (1, 2, 3) if np.cross(front[1] - front[0], front[2] - front[0])[2] < 0 else (1, 3, 2)
        )
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in template]
        lines += ["vt 0 0", "f " + " ".join(f"{corner}/1" for corner in winding)]
        (scans / f"{name}.obj").write_text("\n".join(lines))
        (folder / "wav").mkdir(exist_ok=True)
        for sentence in ("e01", "02"):
            place = folder / "faces" / name / sentence
            place.mkdir(parents=True)
            for number, frame in enumerate(talk(template, 10), 1):
                data = np.int32(vertices).tobytes() + frame.astype("<f4").tobytes()
                (place / f"frame_{number:03}.vl").write_bytes(data)
            soundfile.write(folder / "wav" / f"{name}_{sentence}.wav", resolve_speech(10, 25), RATE)
