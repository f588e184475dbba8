"""The built-in head's shapes on other heads, and FLAME's parameters, against what is known.

    python -m benchmarks.adoption                    # a mesh laid out as FLAME's, five faces
    python -m benchmarks.adoption --ict FOLDER       # and ICT-FaceKit's own shapes (FaceXModel)
    python -m benchmarks.adoption --solve            # and parameters found again

FLAME may not be passed on: its stand-in is `tests/support/flame_layout.py`, faces of the built-in
head on the dual of its mesh, whose own shapes are known. ICT-FaceKit's were sculpted by others, so
what differs there is taste as well as error.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import elocute
from elocute.adoption.carrying import adopt
from elocute.adoption.flame import adopt_flame
from elocute.array_types import Float64Array
from elocute.head.builtin import load_builtin_head
from elocute.head.flame import FlameModel, flame_vertices
from elocute.head.flame_solver import solve_flame
from elocute.head.identity import sample_identity
from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import measure_mouth
from recipes.example import TARGET as EXAMPLE
from recipes.heads_speak import THEIR_SHAPES
from tests.support.flame_layout import FACE_VERTICES, FlameLayout, flame_layout

FACES = (None, 0, 1, 2, 3)
CLOSED_MM = 0.05
FLAMES_OWN = ("jawOpen", "mouthClose")
SOLVED_FRAMES = 10


def alike(found: Float64Array, true: Float64Array) -> tuple[float, float, float]:
    """Correlation, mean mm off where the true shape (vertex, 3) m moves, and mm it moves there."""
    length = np.linalg.norm(true, axis=1)
    moving = length > 0.05 * length.max()
    off = np.linalg.norm(found - true, axis=1)[moving]
    both = np.sqrt(np.square(found).sum() * np.square(true).sum())
    return float((found * true).sum() / both), 1000 * off.mean(), 1000 * length[moving].mean()


def model_of(layout: FlameLayout) -> FlameModel:
    """The layout's entries as `load_flame` would read them."""
    entries = layout.entries
    return FlameModel(
        template=entries["v_template"],
        identity_basis=entries["shapedirs"][:, :, :300],
        expression_basis=entries["shapedirs"][:, :, 300:],
        pose_basis=entries["posedirs"],
        joint_regressor=entries["J_regressor"].toarray(),
        skin_weights=entries["weights"],
        parents=(-1, 0, 1, 1, 1),
        triangles=entries["f"].astype(np.int32),
    )


def flame_faces(curves: Curves) -> None:
    """One row for each face of the stand-in."""
    opening = measure_mouth(motion_from_curves(load_builtin_head(), curves))["opening_mm"]
    print("| face | r mean | r least | mm off, mean | lip gap r | closed, mm at most | s |")
    for who in FACES:
        layout = flame_layout(None if who is None else sample_identity(who))
        model = model_of(layout)
        started = time.process_time()
        head = adopt_flame(model).head
        seconds = time.process_time() - started
        rows = []
        for name, found in zip(head.expression_names, head.expression_basis, strict=True):
            true = layout.truth(name)
            if name not in FLAMES_OWN and np.abs(true).max() > 1e-5:
                rows.append((name, *alike(found[:FACE_VERTICES].astype(np.float64), true)))
        worst = min(rows, key=lambda row: row[1])
        gap = measure_mouth(motion_from_curves(head, curves))["opening_mm"]
        print(
            f"| {'mean' if who is None else who} | {np.mean([row[1] for row in rows]):.3f} | "
            f"{worst[1]:.3f} ({worst[0]}) | {np.mean([row[2] for row in rows]):.2f} | "
            f"{np.corrcoef(opening, gap)[0, 1]:.4f} | {gap[opening < CLOSED_MM].max():.2f} | "
            f"{seconds:.1f} |"
        )


def read_obj(path: Path) -> tuple[Float64Array, NDArray[np.int32], list[str]]:
    """Vertices (vertex, 3) m of centimetres, faces (face, 4), and the material of each face."""
    points, faces, materials, material = [], [], [], ""
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "usemtl":
            material = words[0]
        elif kind == "f":
            corners = [int(word.split("/")[0]) - 1 for word in words]
            faces.append((corners * 2)[:3] + corners[-1:])
            materials.append(material)
    return 0.01 * np.array(points), np.array(faces, np.int32), materials


def ict_head(folder: Path) -> tuple[HeadModel, NDArray[np.intp]]:
    """ICT-FaceKit's neutral head with its landmarks, and the vertices of its face."""
    points, faces, materials = read_obj(folder / "generic_neutral_mesh.obj")
    places = json.loads((folder / "vertex_indices.json").read_text(encoding="utf-8"))
    head = head_from_arrays("ICT", points, faces)
    landmarks = np.array(places["idx_to_landmark_verts"], np.int32)
    face = np.unique(faces[np.array(materials) == "M_Face"]).astype(np.intp)
    return replace(head, landmarks=landmarks), face


def ict_shapes(folder: Path, curves: Curves) -> None:
    target, face = ict_head(folder)
    started = time.process_time()
    adoption = adopt(load_builtin_head(), target)
    seconds = time.process_time() - started
    head, skin, places = adoption.head, adoption.transfer.target.skin, adoption.transfer.places
    shown = np.intersect1d(face, skin[places.confidence > 0.5])
    print("| ICT-FaceKit's shape | r | mm off | mm moved |")
    for theirs, ours in THEIR_SHAPES.items():
        true = read_obj(folder / f"{theirs}.obj")[0] - target.template
        found = head.expression_basis[head.expression_index(ours)].astype(np.float64)
        r, off_mm, moved_mm = alike(found[shown], true[shown])
        print(f"| {ours} | {r:.2f} | {off_mm:.1f} | {moved_mm:.1f} |")
    opening, gap = (
        measure_mouth(motion_from_curves(each, curves))["opening_mm"]
        for each in (load_builtin_head(), head)
    )
    r, closed = np.corrcoef(opening, gap)[0, 1], gap[opening < CLOSED_MM].max()
    print(f"lip gap r {r:.4f}, closed {closed:.2f} mm at most, {seconds:.1f} s")


def solved() -> None:
    """Parameters that FLAME's equations gave, found again."""
    model = model_of(flame_layout())
    rng = np.random.default_rng(0)
    shape = np.zeros(300)
    shape[:50] = rng.normal(0, 0.8, 50)
    expression = np.cumsum(rng.normal(0, 0.2, (SOLVED_FRAMES, 100)), axis=0)
    pose = rng.normal(0, 0.05, (SOLVED_FRAMES, 15))
    pose[:, 6] = np.linspace(0, 0.3, SOLVED_FRAMES)
    shift = rng.normal(0, 0.05, (SOLVED_FRAMES, 3))
    exact = flame_vertices(model, shape, expression, pose, shift)
    print("| given | mm left | shape | expression | jaw, degrees | s a frame |")
    for what, noise_mm, cost in (("exact", 0.0, 1e-6), ("0.5 mm of noise", 0.5, 5e-5)):
        given = exact + rng.normal(0, noise_mm / 1000, exact.shape)
        started = time.process_time()
        found, _ = solve_flame(model, given, regularisation=cost)
        seconds = (time.process_time() - started) / SOLVED_FRAMES
        left = 1000 * np.linalg.norm(found.vertices(model) - exact, axis=2).mean()
        jaw = np.degrees(np.abs(found.pose[:, 6:9] - pose[:, 6:9]).max())
        print(
            f"| {what} | {left:.5f} | {np.abs(found.shape - shape)[:50].max():.4f} | "
            f"{np.abs(found.expression - expression).max():.4f} | {jaw:.4f} | {seconds:.2f} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--ict", type=Path, help="ICT-FaceKit's folder FaceXModel")
    parser.add_argument("--solve", action="store_true", help="find FLAME's parameters again")
    arguments = parser.parse_args()
    curves = elocute.animate(EXAMPLE, model="articulation", life=0).curves
    flame_faces(curves)
    if arguments.ict:
        ict_shapes(arguments.ict, curves)
    if arguments.solve:
        solved()


if __name__ == "__main__":
    main()
