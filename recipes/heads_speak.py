"""The pictures of heads made elsewhere that speak, in README and docs/use/heads.md.

    python -m recipes.heads_speak scan bust.glb color.jpg landmarks.json -o scan_speaks.jpg
    python -m recipes.heads_speak mesh FaceXModel -o mesh_speaks.glb
    python -m recipes.heads_speak character FaceXModel -o character_speaks.glb
    blender-python -m recipes.heads_speak blender mesh_speaks.glb -o mesh_speaks.jpg
    blender-python -m recipes.heads_speak blender character_speaks.glb -o character_speaks.jpg \\
        --track "speech 2"

`scan`: Lee Perry-Smith's bust without shapes, its picture of 1024 pixels, and its 68 landmarks in
metres. `mesh`: ICT-FaceKit's neutral head, given ARKit's shapes in its own file. `character`: the
same head as a character whose own seven shapes, named by ARKit, are moved. Blender (PyPI's bpy)
draws what was written.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
UNIT_M = 0.05
"""The scan's own unit, by the distance of the eyes."""
FPS, SIDE = 10, 360
ENDS = (".glb", ".json", "_arkit.glb")
FRAMES = (0, 21, 61, 58)
VIEWS = ("front", "three-quarter")
SRGB = {
    "M_Face": (206, 162, 142),
    "M_BackHead": (206, 162, 142),
    "M_GumsTongue": (165, 82, 84),
    "M_Teeth": (236, 232, 222),
    "M_ScleraLeft": (232, 230, 228),
    "M_ScleraRight": (232, 230, 228),
}
"""Parts of ICT-FaceKit that are shown; the clear ones, irises and lashes need their pictures."""
IRIS, PUPIL, IRIS_COS, PUPIL_COS = (74, 92, 88), (16, 14, 14), 0.9, 0.982
THEIR_SHAPES = {
    "jawOpen": "jawOpen",
    "mouthClose": "mouthClose",
    "mouthFunnel": "mouthFunnel",
    "mouthPucker": "mouthPucker",
    "mouthSmile_L": "mouthSmileLeft",
    "mouthSmile_R": "mouthSmileRight",
    "eyeBlink_L": "eyeBlinkLeft",
}


def scan(given: argparse.Namespace) -> None:
    """The bust as a .glb with its picture, adopted and drawn."""
    import trimesh
    from trimesh.visual.material import PBRMaterial

    from elocute.capture.scanned_head import open_scanned_head

    (part,) = trimesh.load_scene(given.mesh, process=False).geometry.values()
    part.apply_scale(UNIT_M)
    # This file's picture lies beside it, the first row on top.
    part.visual.uv[:, 1] = 1 - part.visual.uv[:, 1]
    part.visual.material = PBRMaterial(name="skin", baseColorTexture=Image.open(given.picture))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bust.glb"
        part.export(file)
        person = open_scanned_head(file, given.landmarks, "m")
    error = person.registration.surface
    print(f"surface {error.median:.2f} mm median, landmarks {person.registration.landmark_mm:.2f}")
    _draw(person.head, given.output)


def ict_parts(folder: Path) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Vertices in centimetres, triangles by material, and the vertices of the 68 landmarks."""
    points, faces, material = [], {}, ""
    for line in (folder / "generic_neutral_mesh.obj").read_text(encoding="utf-8").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "usemtl":
            material = words[0]
        elif kind == "f":
            corners = [int(word.split("/")[0]) - 1 for word in words]
            fan = itertools.pairwise(corners[1:])
            faces.setdefault(material, []).extend([corners[0], *pair] for pair in fan)
    places = json.loads((folder / "vertex_indices.json").read_text(encoding="utf-8"))
    marks = np.array(places["idx_to_landmark_verts"])
    return np.array(points), {name: np.array(each) for name, each in faces.items()}, marks


def ict_colors(points: np.ndarray, faces: dict[str, np.ndarray]) -> np.ndarray:
    """(vertex, 3) sRGB of the parts that are shown, with irises painted on the balls."""
    colors = np.full(points.shape, 190, np.uint8)
    for name, color in SRGB.items():
        used = np.unique(faces[name])
        colors[used] = color
        if name.startswith("M_Sclera"):
            around = points[used] - (points[used].min(axis=0) + points[used].max(axis=0)) / 2
            ahead = around[:, 2] / np.linalg.norm(around, axis=1)
            colors[used[ahead > IRIS_COS]] = IRIS
            colors[used[ahead > PUPIL_COS]] = PUPIL
    return colors


def mesh(given: argparse.Namespace) -> None:
    """ICT-FaceKit's head as a .glb without shapes, given ARKit's in its own file, speaking."""
    import trimesh

    import elocute
    from elocute.adoption import adopt_mesh, with_arkit_shapes

    points, faces, marks = ict_parts(given.folder)
    linear = np.round(255 * (ict_colors(points, faces) / 255) ** 2.2).astype(np.uint8)
    scene = trimesh.Scene()
    for name in SRGB:
        used, corners = np.unique(faces[name], return_inverse=True)
        part = trimesh.Trimesh(
            0.01 * points[used],
            corners.reshape(faces[name].shape),
            process=False,
            vertex_colors=linear[used],
        )
        scene.add_geometry(part, node_name=name)
    with tempfile.TemporaryDirectory() as folder:
        bare, landmarks, shaped = (Path(folder) / f"bust{end}" for end in ENDS)
        scene.export(bare, include_normals=True)
        landmarks.write_text(json.dumps({"points": (0.01 * points[marks]).tolist()}))
        made = adopt_mesh(bare, landmarks)
        shaped.write_bytes(with_arkit_shapes(made, bare.name))
        print(f"lips stood {made.adoption.rest_gap_mm:.2f} mm apart")
        spoken = elocute.animate(EXAMPLE, fps=FPS, head=shaped)
        spoken.write(given.output)
    motion = elocute.Motion(made.adoption.head, spoken.motion.weights, FPS)
    opening = elocute.measure_mouth(motion)["opening_mm"]
    print(f"opening {opening.min():.3f} to {opening.max():.1f} mm")


def _draw(head, output: Path) -> None:
    """Four moments of the example from two sides."""
    import elocute
    from elocute.export.options import PictureOptions
    from elocute.export.pictures import open_pictures

    spoken = elocute.animate(EXAMPLE, fps=FPS).motion
    turns = spoken.rotations if head.joint_names == spoken.head.joint_names else None
    motion = elocute.Motion(head, spoken.weights, spoken.fps, turns)
    opening = elocute.measure_mouth(motion)["opening_mm"]
    print(f"opening {opening.min():.3f} to {opening.max():.1f} mm")
    rows = []
    for view in VIEWS:
        with open_pictures(head, (SIDE, SIDE), PictureOptions(view=view, quality="high")) as drawn:
            seen = [motion.vertices(frame, frame + 1)[0].astype(np.float32) for frame in FRAMES]
            rows.append([drawn.frame(vertices)[..., :3] for vertices in seen])
    Image.fromarray(np.vstack([np.hstack(row) for row in rows])).save(output, quality=88)


def character(given: argparse.Namespace) -> None:
    """ICT-FaceKit's head with seven shapes of its own as a .glb, and that file speaking."""
    from dataclasses import replace

    import elocute
    from elocute.export import write
    from elocute.head.mesh import head_from_arrays

    points, faces, _ = ict_parts(given.folder)
    shown = np.concatenate([faces[name] for name in SRGB])
    used, corners = np.unique(shown, return_inverse=True)
    basis = []
    for name in THEIR_SHAPES:
        lines = (given.folder / f"{name}.obj").read_text(encoding="utf-8").splitlines()
        moved = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
        basis.append(0.01 * (moved - points)[used])
    head = head_from_arrays(
        "ict",
        0.01 * points[used],
        corners.reshape(shown.shape),
        expression_names=tuple(THEIR_SHAPES),
        expression_basis=np.array(basis),
    )
    head = replace(head, vertex_color=ict_colors(points, faces)[used])
    still = elocute.Motion(head, np.zeros((2, len(THEIR_SHAPES)), np.float32), 1.0)
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "ict.glb"
        write(still, plain)
        elocute.animate(EXAMPLE, fps=FPS, head=plain).write(given.output)


def blender(given: argparse.Namespace) -> None:
    """Frames of a .glb as Blender imports and draws it."""
    import bpy  # pyright: ignore[reportMissingImports]

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(given.mesh))
    # The file has an animation of its own; what was added is the one to be seen.
    for block in (*bpy.data.objects, *bpy.data.shape_keys):
        data = block.animation_data
        if data is not None:
            data.action = None
            for track in data.nla_tracks:
                track.mute = track.name != given.track
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 24
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.view_settings.view_transform = "Standard"
    world = bpy.data.worlds.new("grey")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.35, 0.37, 0.4, 1)
    scene.world = world
    light = bpy.data.objects.new("key", bpy.data.lights.new("key", "AREA"))
    light.data.energy, light.data.size = 12, 0.5
    light.location, light.rotation_euler = (0.5, -0.9, 0.5), (1.0, 0, 0.5)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens = 100
    for each in (light, camera):
        scene.collection.objects.link(each)
    scene.camera = camera
    rate = scene.render.fps
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for turn in (0.0, 0.7):
            camera.location = (1.1 * np.sin(turn), -1.1 * np.cos(turn) + 0.05, given.height)
            camera.rotation_euler = (np.pi / 2, 0, turn)
            row = []
            for frame in FRAMES:
                scene.frame_set(round(frame / FPS * rate))
                scene.render.filepath = str(Path(folder) / "frame.png")
                bpy.ops.render.render(write_still=True)
                row.append(np.asarray(Image.open(scene.render.filepath).convert("RGB")))
            rows.append(np.hstack(row))
    Image.fromarray(np.vstack(rows)).save(given.output, quality=88)


COMMANDS: dict[str, tuple[Callable[[argparse.Namespace], None], tuple[str, ...]]] = {
    "scan": (scan, ("mesh", "picture", "landmarks")),
    "mesh": (mesh, ("folder",)),
    "character": (character, ("folder",)),
    "blender": (blender, ("mesh",)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    commands = parser.add_subparsers(required=True)
    for name, (run, files) in COMMANDS.items():
        command = commands.add_parser(name)
        for file in files:
            command.add_argument(file, type=Path)
        command.add_argument("-o", "--output", type=Path, required=True)
        if name == "blender":
            command.add_argument("--height", type=float, default=-0.015, help="of the camera, m")
            command.add_argument("--track", default="speech", help="the animation that is drawn")
        command.set_defaults(run=run)
    given = parser.parse_args(sys.argv[1:])
    given.run(given)


if __name__ == "__main__":
    main()
