"""What ufbx, which knows nothing of us, finds in an FBX file, told as JSON.

Arguments: the file, and times in seconds at which vertices and weights are computed from shapes,
joints and curves. It is a process of its own, since its lists do not keep what they came from: each
is held here in `held`.
"""

from __future__ import annotations

import base64
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

held: list[Any] = []


def hold(thing: Any) -> Any:
    held.append(thing)
    return thing


def each(things: Any) -> list[Any]:
    hold(things)
    return [hold(things[index]) for index in range(len(things))]


def shown_at(scene: Any, anim: Any, channels: list[Any], time_s: float) -> dict[str, Any]:
    import ufbx

    seen = hold(scene.evaluate(anim, time_s, evaluate_skinning=True))
    mesh = each(seen.meshes)[0]
    values = hold(hold(mesh.skinned_position).values)
    weights = [ufbx.evaluate_blend_weight(anim, channel, time_s) for channel in channels]
    return {"points": [list(point) for point in values], "weights": weights}


def read(path: str, times_s: list[float]) -> dict[str, Any]:
    import ufbx

    scene: Any = hold(ufbx.load_file(path))
    settings, stack = hold(scene.settings), each(scene.anim_stacks)[0]
    mesh = each(scene.meshes)[0]
    deformers = each(scene.blend_deformers)
    channels = each(deformers[0].channels) if deformers else []
    skins = each(scene.skin_deformers)
    clusters = each(skins[0].clusters) if skins else []
    curves = [each(curve.keyframes) for curve in each(scene.anim_curves)]
    materials = each(scene.materials)
    clear = [hold(hold(hold(material.fbx).transparency_color).texture) for material in materials]
    return {
        "warnings": [warning.description for warning in each(hold(scene.metadata).warnings)],
        "fps": settings.frames_per_second,
        "unit_m": settings.unit_meters,
        "takes": [take.name for take in each(scene.anim_stacks)],
        "span_s": [stack.time_begin, stack.time_end],
        "vertices": [list(point) for point in hold(mesh.vertices)],
        "faces": [face.num_indices for face in each(mesh.faces)],
        "corners": list(hold(mesh.vertex_indices)),
        "face_materials": list(hold(mesh.face_material)),
        "materials": [material.name for material in materials],
        "clear": [None if texture is None else texture.name for texture in clear],
        "images": {
            texture.name: base64.b64encode(bytes(hold(texture.content))).decode()
            for texture in each(scene.textures)
        },
        "channels": [channel.name for channel in channels],
        "keys": [len(keys) for keys in curves],
        "last_s": max((key.time for keys in curves for key in keys), default=0.0),
        "joints": [hold(cluster.bone_node).name for cluster in clusters],
        "skin": [
            [list(hold(cluster.vertices)), list(hold(cluster.weights))] for cluster in clusters
        ],
        "at": [shown_at(scene, hold(stack.anim), channels, time_s) for time_s in times_s],
    }


def read_fbx_apart(path: Path, *times_s: float) -> dict[str, Any]:
    """The same, from another process."""
    command = [sys.executable, __file__, str(path), *map(str, times_s)]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)


if __name__ == "__main__":
    print(json.dumps(read(sys.argv[1], list(map(float, sys.argv[2:])))))
    sys.stdout.flush()
