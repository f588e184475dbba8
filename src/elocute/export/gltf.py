"""glTF 2.0 (.glb): morph targets with names and weight animation, joints, images, the sound.

One mesh, so that a single weights channel moves everything; a primitive for each material, two over
the same corners where a material blends. Shapes are sparse accessors. jawOpen is a morph target;
the jaw joint is there to pose, and rests. What was done to fit the format stands in `asset.extras`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import OutputError
from elocute.export.character_weights import CharacterMotion
from elocute.export.gltf_character import bare_take, character_glb, take_glb, with_takes
from elocute.export.gltf_file import Channels, GltfFile, unit_xyzw
from elocute.export.gltf_materials import MaterialIndices, add_materials
from elocute.export.options import GlbOptions
from elocute.export.shape_profiles import Targets, target_shapes
from elocute.export.soundtrack import Sound, pack_sound, sound_source, write_wav
from elocute.export.sunk_irises import sunk
from elocute.files.atomic import write_atomically
from elocute.files.output_plan import OutputPlan
from elocute.head.folds import ZONES
from elocute.head.looks.folds import folds_of
from elocute.head.looks.skin import picture_for_engines
from elocute.head.model import HeadModel
from elocute.head.normals import (
    linear_colors,
    morphed_normals,
    moved_vertices,
    vertex_normals,
)
from elocute.head.surface import Surface
from elocute.motion.motion import Motion
from elocute.render.parts import rounded_normals, strands
from elocute.render.shading import finish_of, socket_shade

FACE = "face"
NORMAL_STEP = 0.01  # changes of a unit normal below this are not stored
DEEPEST_HAIR = 0.13  # linear share of its colour
FRINGE_LIFT_M = 1e-4  # ray tracers see one surface, not two at once
# Of what is stored: a metre's are of a micrometre.
STEPS_OF_NORMAL, STEPS_OF_STRAND, STEPS_OF_METRE = 2**10, 2**6, 2**20
# Joints as engines and avatars name them, with other names that programs look for.
JOINTS: dict[str, tuple[str, ...]] = {
    "neck": ("Neck", "neck_01", "mixamorig:Neck", "CC_Base_NeckTwist01", "J_Bip_C_Neck"),
    "head": ("Head", "head", "mixamorig:Head", "CC_Base_Head", "J_Bip_C_Head"),
    "jaw": ("Jaw", "jaw", "mixamorig:Jaw", "CC_Base_JawRoot", "FACIAL_C_Jaw"),
    "eyeLeft": ("LeftEye", "eye_l", "mixamorig:LeftEye", "CC_Base_L_Eye", "J_Adj_L_FaceEye"),
    "eyeRight": ("RightEye", "eye_r", "mixamorig:RightEye", "CC_Base_R_Eye", "J_Adj_R_FaceEye"),
}


def write_glb(
    motion: Motion,
    path: str | Path,
    *,
    sound: Sound | None = None,
    options: GlbOptions | None = None,
    overwrite: bool = False,
    progress: Any = None,
) -> None:
    """Write an animated head as .glb, its sound beside it as NAME.wav or inside.

    A head that stands for a character in a file of its own moves there. A sound that is NAME.wav
    already is left alone; overwrite: whether to replace a NAME.wav that an earlier call did not
    make from this very sound, or that was changed since. The file is written at once: `progress` is
    not called.

    Raises OutputError for a place that cannot be written, and a NAME.wav that would be replaced
    without `overwrite`; nothing is written then.
    """
    path, options = Path(path), options or GlbOptions()
    if options.add and motion.head.character is None:
        raise OutputError.about(
            path,
            found=f"`add` with {motion.head.name}",
            allowed="a character of your own",
            remedy="write the head as .glb once and take that as the head",
        )
    silent = options.add or options.animation_only  # many takes, or what moves alone
    beside = None if options.embed_audio or silent or sound is None else wav_beside(path, sound)
    if beside is None or sound is None:
        inside = sound if options.embed_audio else None
        with write_atomically(path) as draft:
            draft.write_bytes(_file_bytes(motion, path, inside, options))
        return
    plan = OutputPlan(remedy="overwrite=True replaces it")
    plan.add(beside, sound_source(sound), beside=path)
    plan.check(overwrite=overwrite)
    with plan.writing(beside), write_atomically(beside) as wav, write_atomically(path) as draft:
        write_wav(sound, wav)
        draft.write_bytes(_file_bytes(motion, path, None, options))


def _file_bytes(motion: Motion, path: Path, sound: Sound | None, options: GlbOptions) -> bytes:
    """A file of the head's own, or the file of the character that it moves."""
    character = motion.head.character
    if character is None:
        return (
            _bare_head(motion, options)
            if options.animation_only
            else glb_bytes(motion, sound, options)
        )
    if options.animation_only:
        return take_glb(motion, character, options.action)
    if options.add:
        character = with_takes(character, path)
    return character_glb(motion, character, sound, options.action, replace=options.replace_action)


def _bare_head(motion: Motion, options: GlbOptions) -> bytes:
    """The built-in head's take without its mesh: the same nodes under the same names."""
    shapes = target_shapes(motion.head, options.profile, options.visemes)
    nodes: list[dict[str, Any]] = [{"name": FACE}]
    roots = [0, *joint_nodes(motion.head, nodes)]
    turns = {}
    if motion.rotations is not None:
        turned = np.moveaxis(motion.rotations, 1, 0)
        turns = {1 + joint: unit_xyzw(each) for joint, each in enumerate(turned)}
    moved = CharacterMotion({0: shapes.weights(motion)}, turns, {}, {})
    names, record = {0: list(shapes.names)}, {"profile": options.profile, "fps": motion.fps}
    return bare_take(nodes, [{"nodes": roots}], names, moved, motion, options.action_name, record)


def wav_beside(path: Path, sound: Sound) -> Path | None:
    """Where the sound of a .glb goes, or None where it lies there already."""
    beside = path.with_suffix(".wav")
    try:
        is_there = isinstance(sound, str | Path) and Path(sound).samefile(beside)
    except (OSError, ValueError):  # one of them is not there, or cannot be
        is_there = False
    return None if is_there else beside


def glb_bytes(
    motion: Motion,
    sound: Sound | None = None,
    options: GlbOptions | None = None,
    *,
    for_viewer: bool = False,
) -> bytes:
    """An animated head as the bytes of a .glb, with its sound inside where one is given.

    for_viewer: whether our own viewer draws it, which knows occlusion, strands, folds and the shade
    of lids: vertices carry the occlusion that their colours hold (`_OCCLUSION`), the direction of
    hair (`_STRAND`) and where they fold (`_FOLDS_0` to `_FOLDS_3`).

    Raises OutputError for visemes of a head that lacks the shapes that make them, HeadError for a
    head with an image that is none, and MachineError where a small file is wanted and `meshopt` is
    not installed.
    """
    file = animated_file(motion.dressed(), options or GlbOptions(), for_viewer)
    if sound is not None:
        _embed(file, sound)
    if options is None or not options.web:
        return file.pack()
    from elocute.export.gltf_web import web_glb

    return web_glb(file.pack())


def animated_file(motion: Motion, options: GlbOptions, for_viewer: bool = False) -> GltfFile:
    """An animated, dressed head as a file to which more can be added.

    Node 0 has the mesh, the nodes after it are the head's joints in their order. Raises as
    `glb_bytes`.
    """
    file = GltfFile()
    head = motion.head if for_viewer else _with_skin_for_engines(motion.head)
    shapes = target_shapes(head, options.profile, options.visemes)
    materials = add_materials(file, head, folds=for_viewer)
    file.json["asset"] |= {"copyright": head.notice} if head.notice else {}
    file.json["asset"]["extras"] = {"elocute": _record(motion, shapes, materials, options)}
    mesh = {
        "name": "head",
        "primitives": _primitives(file, head, shapes, materials, for_viewer),
        "weights": [0.0] * len(shapes.names),
        "extras": {"targetNames": list(shapes.names)},
    }
    file.json["meshes"] = [mesh]
    nodes: list[dict[str, Any]] = [{"name": FACE, "mesh": 0}]
    roots = [0]
    if head.joint_names:
        file.json["skins"] = [_skin(file, head, len(nodes))]
        roots += joint_nodes(head, nodes)
        nodes[0]["skin"] = 0
    file.json["nodes"] = nodes
    file.json["scenes"] = [{"nodes": roots}]
    _animate(file, motion, shapes, options.action_name)
    return file


def _record(
    motion: Motion,
    shapes: Targets,
    materials: list[MaterialIndices],
    options: GlbOptions,
) -> dict[str, Any]:
    """What was done to make the head fit the format."""
    names = motion.head.joint_names
    record: dict[str, Any] = {
        "profile": options.profile,
        "unit": "m",
        "fps": motion.fps,
        "joints": {name: JOINTS[name][0] for name in names if name in JOINTS},
    }
    left = shapes.report(motion)
    if left:
        record["fitted" if "residual_mm" in left else "folded"] = left
    images = {
        name: material.images
        for name, material in zip(motion.head.material_names, materials, strict=True)
        if material.images
    }
    return record | ({"images": images} if images else {})


def _primitives(
    file: GltfFile,
    head: HeadModel,
    shapes: Targets,
    materials: list[MaterialIndices],
    for_viewer: bool,
) -> list[dict[str, Any]]:
    """Primitives of each material that has faces; `for_viewer`: with what our own pages draw."""
    normals = vertex_normals(head.template, head.triangles)
    places, basis, colors = head.template, shapes.basis, linear_colors(head)
    if not for_viewer:
        places, basis = sunk(head, basis)
        colors = _for_engines(head, colors, normals)
    cards = "hair" in head.surfaces and not for_viewer
    if cards:
        hair = _vertices_of(head, "hair")
        normals[hair] = rounded_normals(places[hair], normals[hair])
    moves = _moves(head, shapes.basis, basis)
    result = []
    folds = folds_of(head) if for_viewer else None
    along = strands(head) if for_viewer else None
    for index, (name, material) in enumerate(zip(head.material_names, materials, strict=True)):
        vertices, texels, faces = corners_of(head, index)
        if not len(faces):
            continue
        if cards and name == "hair":
            faces = _facing_out(faces, places[vertices], normals[vertices])
        attributes = {"POSITION": _positions(file, places[vertices])}
        attributes |= _attributes(file, head, vertices, texels, normals, colors)
        if for_viewer:
            occlusion = head.occlusion[vertices].astype(np.float32)
            attributes["_OCCLUSION"] = file.attribute(occlusion)
        if along is not None and finish_of(name).strand:
            attributes["_STRAND"] = file.attribute(_stepped(along[vertices], STEPS_OF_STRAND))
        if folds is not None and head.surfaces.get(name, Surface()).folds:
            for first, masks in enumerate(np.split(folds.masks_at(vertices), ZONES // 4, axis=1)):
                attributes[f"_FOLDS_{first}"] = file.attribute(masks, normalized=True)
        targets = [
            {
                name: _target(file, vertices, *part, bounds=name == "POSITION")
                for name, part in shape.items()
            }
            for shape in moves
        ]
        indices = file.indices(faces, len(vertices))
        primitive = {"attributes": attributes, "indices": indices}
        primitive |= {"targets": targets} if targets else {}
        first, *fringes = material.indices
        result.append(primitive | {"material": first})
        if fringes and not for_viewer:
            lifted = head.template[vertices] + FRINGE_LIFT_M * normals[vertices]
            primitive["attributes"] = attributes | {"POSITION": _positions(file, lifted)}
        result += [primitive | {"material": each} for each in fringes]
    return result


def corners_of(
    head: HeadModel, material: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """The corners of a material's faces, split where texture seams need it.

    Vertex and texture coordinate of each corner (corner,), and the corners of the triangles (3
    triangle,).
    """
    chosen = head.triangle_material == material
    triangles, texels = head.triangles[chosen].ravel(), head.uv_triangles[chosen].ravel()
    corners, faces = np.unique(triangles * np.int64(len(head.uv)) + texels, return_inverse=True)
    return *np.divmod(corners, len(head.uv)), faces.ravel()


def _positions(file: GltfFile, points: NDArray[np.floating[Any]]) -> int:
    return file.attribute(points.astype(np.float32), bounds=True)


def _attributes(
    file: GltfFile,
    head: HeadModel,
    vertices: NDArray[Any],
    texels: NDArray[Any],
    normals: NDArray[np.float32],
    colors: NDArray[np.float32],
) -> dict[str, int]:
    uv = head.uv[texels].astype(np.float32) * [1, -1] + [0, 1]  # glTF counts from the top
    rgba = np.concatenate([colors[vertices], np.ones((len(vertices), 1))], axis=1)
    attributes = {
        "NORMAL": file.attribute(_stepped(_unit(normals[vertices]), STEPS_OF_NORMAL)),
        "TEXCOORD_0": file.attribute(uv.astype(np.float32)),
        "COLOR_0": file.attribute(np.round(rgba * 65535).astype(np.uint16), normalized=True),
    }
    if head.joint_names:
        joints, weights = _four_joints(head.skin_weights[vertices])
        attributes["JOINTS_0"] = file.attribute(joints)
        attributes["WEIGHTS_0"] = file.attribute(weights)
    return attributes


def _for_engines(
    head: HeadModel, colors: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Colours for where shadows are not drawn, nor the light that comes through skin: eyes lie in
    their sockets, else they would stare; the deepest hair is no black, else its ends would be
    specks between lit hair."""
    shaded = colors.copy()
    eyes, hair = (_vertices_of(head, name) for name in ("eyeball", "hair"))
    shaded[eyes] *= socket_shade(normals[eyes])
    if "hair" in head.surfaces:
        shaded[hair] = np.maximum(shaded[hair], np.float32(DEEPEST_HAIR))
    return shaded


def _with_skin_for_engines(head: HeadModel) -> HeadModel:
    """A head whose skin other programs draw as our pictures show it. Those of looks alone, which
    are the ones with folds: pictures from elsewhere stay as they are."""
    skin = head.surfaces.get("skin", Surface())
    if not skin.folds:
        return head
    color = picture_for_engines(skin.color)
    return replace(head, surfaces={**head.surfaces, "skin": replace(skin, color=color)})


def _facing_out(
    faces: NDArray[np.integer[Any]],
    places: NDArray[np.float32],
    normals: NDArray[np.float32],
) -> NDArray[np.integer[Any]]:
    """Triangles (3 triangle,) turned so that their fronts are where the normals point: engines turn
    normals of the backs round, and hair with them would be lit from below."""
    triangles = faces.reshape(-1, 3)
    a, b, c = (places[triangles[:, k]] for k in range(3))
    across = (np.cross(b - a, c - a) * normals[triangles].sum(axis=1)).sum(axis=1)
    return np.where(across[:, None] < 0, triangles[:, ::-1], triangles).ravel()


def _vertices_of(head: HeadModel, name: str) -> NDArray[np.integer[Any]]:
    named = np.array([material == name for material in head.material_names])
    return np.unique(head.triangles[named[head.triangle_material]])


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """A vertex of no area still needs a unit normal."""
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0.5, normals / np.maximum(lengths, 1e-6), [[0, 0, 1]]).astype(
        np.float32
    )


def _stepped(values: NDArray[np.float32], steps: int) -> NDArray[np.float32]:
    """Values in steps of their unit: floats of few bits pack well, in a page and over the net."""
    return np.round(values * np.float32(steps)) / np.float32(steps)


def _four_joints(weights: NDArray[np.float32]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """The four strongest joints of each vertex; no joint twice, unused ones zero."""
    padded = np.pad(weights, ((0, 0), (0, max(0, 4 - weights.shape[1]))))
    joints = np.argsort(-padded, axis=1)[:, :4]
    kept = np.take_along_axis(padded, joints, axis=1)
    kept = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1e-9)
    return np.where(kept > 0, joints, 0).astype(np.uint8), kept.astype(np.float32)


_Part = tuple[NDArray[np.bool_], NDArray[np.float32]]


def _moves(
    head: HeadModel, shapes: NDArray[np.float32], drawn: NDArray[np.float32]
) -> list[dict[str, _Part]]:
    """Per shape: (vertex,) which vertices it moves and turns, and (vertex, 3) by how much; turned
    as by `shapes`, moved as by `drawn`."""
    moves: list[dict[str, _Part]] = []
    turns = morphed_normals(head.template, head.triangles, shapes)
    for delta, (near, change) in zip(drawn, turns, strict=True):
        clear = (change * change).sum(axis=1) > NORMAL_STEP**2
        turned, turn = np.zeros(len(delta), bool), np.zeros_like(delta)
        turned[near[clear]], turn[near[clear]] = True, _stepped(change[clear], STEPS_OF_NORMAL)
        delta = _stepped(delta, STEPS_OF_METRE)
        moves.append({"POSITION": (moved_vertices(delta), delta), "NORMAL": (turned, turn)})
    return moves


def _target(
    file: GltfFile,
    vertices: NDArray[Any],
    moved: NDArray[np.bool_],
    deltas: NDArray[np.float32],
    bounds: bool,
) -> int:
    """One morph target of the primitive whose corners stand on `vertices`."""
    rows = np.flatnonzero(moved[vertices])
    return file.sparse(rows, deltas[vertices[rows]], len(vertices), bounds)


def joint_offsets(head: HeadModel) -> NDArray[np.float64]:
    """(joint, 3) m from the joint that each hangs from, else from the origin."""
    places = head.joint_positions.astype(np.float64)
    parents = np.array(head.joint_parents, np.intp)
    return places - np.where((parents >= 0)[:, None], places[parents], 0)


def joint_nodes(head: HeadModel, nodes: list[dict[str, Any]]) -> list[int]:
    """Append a node for each joint of a head, in their order; returns the root joints."""
    first, offsets = len(nodes), joint_offsets(head)
    for joint, (name, parent) in enumerate(zip(head.joint_names, head.joint_parents, strict=True)):
        known, *aliases = JOINTS.get(name, (name,))
        nodes.append({"name": known, "translation": offsets[joint].tolist()})
        if aliases:
            nodes[-1]["extras"] = {"aliases": aliases}
        if parent >= 0:
            nodes[first + parent].setdefault("children", []).append(first + joint)
    return [first + joint for joint, parent in enumerate(head.joint_parents) if parent < 0]


def _skin(file: GltfFile, head: HeadModel, first: int) -> dict[str, Any]:
    """The skin of joints that begin at node `first`."""
    inverse = np.tile(np.eye(4, dtype=np.float32), (len(head.joint_names), 1, 1))
    inverse[:, 3, :3] = -head.joint_positions  # columns first, as glTF wants
    bind = file.array(inverse.reshape(-1, 16))
    return {
        "inverseBindMatrices": bind,
        "joints": list(range(first, first + len(head.joint_names))),
    }


def _animate(file: GltfFile, motion: Motion, shapes: Targets, name: str) -> None:
    times = motion.times_s.astype(np.float32)
    speech = Channels(file.array(times, bounds=True))
    if shapes.names:
        speech.move(0, "weights", file.array(shapes.weights(motion).ravel()))
    if motion.rotations is not None:
        for joint in range(motion.rotations.shape[1]):
            turns = unit_xyzw(motion.rotations[:, joint])
            speech.move(1 + joint, "rotation", file.array(turns))
    if speech.channels:
        file.json["animations"] = [speech.animation(name)]


def _embed(file: GltfFile, sound: Sound) -> None:
    """The sound as KHR_audio_emitter describes it; players that do not know it go on without."""
    data, media = pack_sound(sound)
    file.uses("KHR_audio_emitter")
    file.json["extensions"] = {
        "KHR_audio_emitter": {
            "audio": [{"bufferView": file.view(data), "mimeType": media}],
            "sources": [{"audio": 0, "autoPlay": True, "loop": False}],
            "emitters": [{"type": "global", "sources": [0]}],
        }
    }
    file.json["scenes"][0]["extensions"] = {"KHR_audio_emitter": {"emitters": [0]}}
