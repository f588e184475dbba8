# SPDX-FileCopyrightText: 2026 Elocute contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What is done in Blender: a mesh goes out as .glb, a take comes in as keys, markers and sound."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import bpy

from .keys import cleaned, needed
from .take_file import Take

LINEAR = 1
OURS = "elocute"
MARKS = "elocute_marks"


def meshes_of(face: Any) -> list[Any]:
    """The mesh and those with shape keys on the same armature: teeth, tongue, brows."""
    rig = face.find_armature()
    near = [each for each in bpy.context.scene.objects if each.type == "MESH" and each != face]
    return [face] + [
        each
        for each in near
        if rig is not None and each.find_armature() == rig and each.data.shape_keys
    ]


def export_character(face: Any, path: Path) -> None:
    """Write the mesh with its shape keys and joints, and nothing else. Raises RuntimeError."""
    if face is None or face.type != "MESH" or face.data.shape_keys is None:
        raise RuntimeError("pick a mesh with shape keys")
    rig = face.find_armature()
    wanted = [*meshes_of(face), *([rig] if rig else [])]
    layer = bpy.context.view_layer
    before = [each for each in layer.objects if each.select_get()], layer.objects.active
    mode = face.mode
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    try:
        for each in layer.objects:
            each.select_set(each in wanted)
        hidden = [each.name for each in wanted if not each.select_get()]
        if hidden:
            raise RuntimeError(f"{', '.join(hidden)}: hidden; show it in the viewport")
        layer.objects.active = face
        bpy.ops.export_scene.gltf(
            filepath=str(path),
            export_format="GLB",
            use_selection=True,
            export_animations=False,
            export_materials="NONE",
            export_texcoords=False,
            export_morph_normal=False,
            export_extras=False,
        )
    finally:
        for each in layer.objects:
            each.select_set(each in before[0])
        layer.objects.active = before[1]
        if mode != "OBJECT":
            bpy.ops.object.mode_set(mode=mode)


def write_keys(face: Any, take: Take, name: str, start: int) -> list[Any]:
    """Key a take from a frame on, as actions of its name; those it made before are replaced."""
    made = []
    for mesh in meshes_of(face):
        curves = take.shapes.get(mesh.name) or take.shapes.get(mesh.data.name)
        if not curves:
            continue
        keys = mesh.data.shape_keys
        action = _new_action(keys, name if mesh == face else f"{name} {mesh.name}")
        for shape, values in curves.items():
            still = needed(values)
            if shape not in keys.key_blocks or (len(still) < 2 and shape not in take.driven):
                continue
            path = keys.key_blocks[shape].path_from_id("value")
            _fill(curve_of(action, keys, path), [(start + i, values[i]) for i in still])
        made.append(action)
    rig = face.find_armature()
    bones = {} if rig is None else {n: t for n, t in take.turns.items() if n in rig.pose.bones}
    if bones:
        action = _new_action(rig, f"{name} joints")
        for bone, turns in bones.items():
            joint = rig.pose.bones[bone]
            joint.rotation_mode = "QUATERNION"
            path = joint.path_from_id("rotation_quaternion")
            for part in range(4):
                points = [(start + i, turn[part]) for i, turn in enumerate(turns)]
                _fill(curve_of(action, rig, path, part), points)
        made.append(action)
    return made


def _new_action(owner: Any, name: str) -> Any:
    """An action of a name, in use; one that an earlier take left is replaced, others stay."""
    old = bpy.data.actions.get(name)
    if old is not None and old.get(OURS):
        bpy.data.actions.remove(old)
    action = bpy.data.actions.new(name)
    action[OURS] = True
    action.use_fake_user = True
    held = owner.animation_data or owner.animation_data_create()
    held.action = action
    return action


def curve_of(action: Any, owner: Any, path: str, part: int = 0) -> Any:
    """A new curve of an action, in Blender 4 and 5."""
    if hasattr(action, "fcurve_ensure_for_datablock"):
        return action.fcurve_ensure_for_datablock(owner, path, index=part)
    return action.fcurves.new(path, index=part)


def curves_of(action: Any) -> Iterator[Any]:
    """All curves of an action, in Blender 4 and 5."""
    if hasattr(action, "fcurves"):
        yield from action.fcurves
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


def _fill(curve: Any, points: Sequence[tuple[float, float]]) -> None:
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(points))
    curve.keyframe_points.foreach_set("co", [number for point in points for number in point])
    curve.keyframe_points.foreach_set("interpolation", [LINEAR] * len(points))
    curve.update()


def actions_of(face: Any) -> list[Any]:
    """Those of ours that are in use on a mesh and what belongs to it."""
    owners = [mesh.data.shape_keys for mesh in meshes_of(face)]
    owners += [rig] if (rig := face.find_armature()) else []
    held = [each.animation_data.action for each in owners if each and each.animation_data]
    return [action for action in held if action is not None and action.get(OURS)]


def clean(actions: Sequence[Any], tolerance: float) -> tuple[int, int]:
    """Leave the keys that are needed; how many there were, and are."""
    before = after = 0
    for action in actions:
        for curve in curves_of(action):
            points = [tuple(key.co) for key in curve.keyframe_points]
            left = cleaned(points, tolerance)
            before, after = before + len(points), after + len(left)
            _fill(curve, left)
    return before, after


def bake(actions: Sequence[Any]) -> int:
    """Key each frame again as the curves run, also where a person changed them; how many keys."""
    count = 0
    for action in actions:
        for curve in curves_of(action):
            first, last = (round(frame) for frame in curve.range())
            points = [(frame, curve.evaluate(frame)) for frame in range(first, last + 1)]
            _fill(curve, points)
            count += len(points)
    return count


def push_down(face: Any, actions: Sequence[Any]) -> None:
    """Put actions on NLA tracks of their own, so that takes stand one after another."""
    owners = [mesh.data.shape_keys for mesh in meshes_of(face)]
    owners += [rig] if (rig := face.find_armature()) else []
    for owner in owners:
        held = owner.animation_data if owner else None
        if held is None or held.action not in actions:
            continue
        action, track = held.action, held.nla_tracks.new()
        track.name = action.name
        track.strips.new(action.name, round(action.frame_range[0]), action)
        held.action = None


def set_marks(marks: Sequence[tuple[float, str]], fps: float, start: int) -> None:
    """Phones as markers of the timeline; those of an earlier take go."""
    scene = bpy.context.scene
    clear_marks()
    told = []
    for time_s, phone in marks:
        frame = start + round(time_s * fps)
        scene.timeline_markers.new(phone, frame=frame)
        told.append(f"{frame} {phone}")
    scene[MARKS] = "\n".join(told)


def clear_marks() -> None:
    """Remove the markers of an earlier take; those that were moved or renamed stay."""
    scene = bpy.context.scene
    ours = set(str(scene.get(MARKS, "")).splitlines())
    for mark in list(scene.timeline_markers):
        if f"{mark.frame} {mark.name}" in ours:
            scene.timeline_markers.remove(mark)
    scene[MARKS] = ""


def add_sound(sound: str, start: int) -> None:
    """Put the sound where the take begins, and let it lead the playback."""
    scene = bpy.context.scene
    editor = scene.sequence_editor or scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    name = Path(sound).name
    for strip in [each for each in strips if each.name == name and each.type == "SOUND"]:
        strips.remove(strip)
    used = {strip.channel for strip in strips}
    channel = next(number for number in range(1, 129) if number not in used)
    strips.new_sound(name, sound, channel=channel, frame_start=start)
    scene.sync_mode = "AUDIO_SYNC"
