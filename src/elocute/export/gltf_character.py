"""Adds a talking animation to a character's own glTF file; the rest stays as it was.

What is added are items at the ends of lists (animation, accessors, buffer views) and bytes at the
end of the buffer; every other letter of the JSON and every byte of the buffer stays where it was.
A node that is given as a matrix and moves becomes a shift, a turn and a scale, since no other can
be animated.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from elocute.errors import OutputError
from elocute.export.character_weights import CharacterMotion, character_motion, conversion_record
from elocute.export.gltf_file import Channels, GltfFile
from elocute.export.options import ACTION
from elocute.export.soundtrack import Sound, pack_sound
from elocute.head.character import Character
from elocute.meshes.gltf_additions import GltfAdditions, with_items, with_value
from elocute.meshes.gltf_document import GltfDocument, read_gltf
from elocute.meshes.gltf_nodes import without_matrix
from elocute.motion.motion import Motion

ADDED_MAX_BYTES = 2_000_000_000
AUDIO = "KHR_audio_emitter"


def character_glb(
    motion: Motion,
    character: Character,
    sound: Sound | None = None,
    action: str | None = None,
    *,
    replace: bool = False,
) -> bytes:
    """A character's file with a motion of the built-in head as one more animation, as a .glb.

    action: its name; None for one that is free. replace: whether an animation of that name gives
    way to it; its numbers stay in the file, unused. Raises OutputError for the name of an animation
    that is there, and a motion so long that no .glb holds it.
    """
    name, place = _name_of(action, character, replace)
    moved = character_motion(motion, character)
    added = GltfAdditions(character.document)
    clock = added.accessor(motion.times_s.astype(np.float32), "SCALAR", bounds=True)
    speech = Channels(clock)
    _check_size(character, moved)
    for node, weights in moved.weights.items():
        speech.move(node, "weights", added.accessor(weights.reshape(-1), "SCALAR"))
    for node, turns in moved.turns.items():
        speech.move(node, "rotation", added.accessor(turns, "VEC4"))
    record = {"fps": motion.fps, **conversion_record(character, moved)}
    text = _without_matrices(character.document, [*moved.weights, *moved.turns])
    animation = speech.animation(name) | {"extras": {"elocute": record}}
    if place is None:
        text = with_items(text, ["animations"], [animation])
    else:
        text = with_value(text, ["animations", place], animation)
    if sound is not None:
        text = _with_sound(text, character, added, sound)
    return added.pack(text)


def _check_size(character: Character, moved: CharacterMotion) -> None:
    size = sum(each.nbytes for each in (*moved.weights.values(), *moved.turns.values()))
    there = 0 if character.document.binary is None else len(character.document.binary)
    if size + there > ADDED_MAX_BYTES:
        raise OutputError.about(
            character.name,
            found=f"an animation of {size / 1e9:.1f} GB",
            allowed=f"{ADDED_MAX_BYTES / 1e9:g} GB",
            remedy="a lower `fps` makes it smaller",
        )


def _without_matrices(document: GltfDocument, nodes: list[int]) -> str:
    text = document.text
    for node in nodes:
        record = document.records("nodes")[node]
        turned = without_matrix(record)
        if turned is not None and turned is not record:
            text = with_value(text, ["nodes", node], turned)
    return text


def actions_of(document: GltfDocument) -> list[str]:
    """The names of the animations of a file, in their order; "" for one without."""
    return [str(each.get("name", "")) for each in document.records("animations")]


def _name_of(action: str | None, character: Character, replace: bool) -> tuple[str, int | None]:
    """The name of the new animation, and which it replaces: `speech` by default, with a number
    where that is taken."""
    taken = actions_of(character.document)
    if action in taken:
        if not replace:
            raise OutputError.about(
                character.name,
                found=f"an animation {action!r} already",
                allowed="a name that is free",
                remedy="`replace_action` replaces it",
            )
        return str(action), taken.index(action)
    number, name = 1, action or ACTION
    while name in taken:
        number += 1
        name = f"{ACTION} {number}"
    return name, None


def with_takes(character: Character, path: str | Path) -> Character:
    """The character with the takes that a file of it has, which may lie there already.

    Raises OutputError for a file of another character, and one that is damaged.
    """
    path = Path(path)
    if not path.exists():
        return character
    document = read_gltf(path, error=OutputError)
    for node in [*character.nodes, *(turn.node for turn in character.turns)]:
        own, there = (_described(each, node) for each in (character.document, document))
        if own != there:
            what = "other shapes" if own[0] == there[0] else f"{there[0]!r} in its place"
            raise OutputError.about(
                path,
                found=f"a file of another character than {character.name}, of whose "
                f"{own[0] or f'node {node}'!r} it has {what}",
                allowed=f"takes of {character.name}",
                remedy="name another file",
            )
    return dataclasses.replace(character, document=document)


def _described(document: GltfDocument, node: int) -> tuple[str, Any]:
    """The name of a node, and the shapes of its mesh."""
    nodes, meshes = document.records("nodes"), document.records("meshes")
    if node >= len(nodes):
        return "", None
    record = nodes[node]
    mesh = meshes[record["mesh"]] if "mesh" in record else {}
    extras = mesh.get("extras")
    names = extras.get("targetNames") if isinstance(extras, dict) else None
    counts = [len(each.get("targets", ())) for each in mesh.get("primitives", ())]
    return str(record.get("name", "")), (counts, names)


def take_glb(motion: Motion, character: Character, action: str | None = None) -> bytes:
    """A motion of a character without the character: its nodes, and what moves them.

    Meshes are left with the names of their shapes, on one triangle without an area, since no
    weights can move a node without a mesh.
    """
    moved = character_motion(motion, character)
    document, shapes = character.document, {}
    for node in moved.weights:
        record = document.records("nodes")[node]
        mesh = document.records("meshes")[record["mesh"]]
        extras = mesh.get("extras")
        told = extras.get("targetNames") if isinstance(extras, dict) else None
        count = character.target_count(record["mesh"])
        shapes[node] = told if isinstance(told, list) else [f"target_{k}" for k in range(count)]
    nodes = [
        {name: value for name, value in (without_matrix(each) or each).items() if name in KEPT}
        for each in document.records("nodes")
    ]
    record = {"fps": motion.fps, **conversion_record(character, moved)}
    scenes = [{"nodes": each.get("nodes", [])} for each in document.records("scenes")]
    return bare_take(nodes, scenes, shapes, moved, motion, action or ACTION, record)


KEPT = ("name", "children", "translation", "rotation", "scale", "matrix")
"""Of a node, in a file without what it carries."""


def bare_take(
    nodes: list[dict[str, Any]],
    scenes: list[dict[str, Any]],
    shapes: dict[int, list[str]],
    moved: CharacterMotion,
    motion: Motion,
    action: str,
    record: dict[str, Any],
) -> bytes:
    """A .glb of nodes and one animation; shapes: the names of their shapes, by node."""
    file = GltfFile()
    file.json["asset"]["extras"] = {"elocute": {"animation_only": True, "fps": motion.fps}}
    point = np.zeros((3, 3), np.float32)
    still = file.sparse(np.zeros(0, np.intp), point[:0], 3, bounds=True)
    for node, names in shapes.items():
        primitive = {
            "attributes": {"POSITION": file.attribute(point, bounds=True)},
            "targets": [{"POSITION": still}] * len(names),
        }
        mesh = {"primitives": [primitive], "extras": {"targetNames": names}}
        nodes[node]["mesh"] = file.add("meshes", {"name": f"shapes of {node}"} | mesh)
    speech = Channels(file.array(motion.times_s.astype(np.float32), bounds=True))
    for node, weights in moved.weights.items():
        speech.move(node, "weights", file.array(weights.ravel()))
    for node, turns in moved.turns.items():
        speech.move(node, "rotation", file.array(turns))
    file.json["nodes"], file.json["scenes"] = nodes, scenes
    file.json["animations"] = [speech.animation(action) | {"extras": {"elocute": record}}]
    return file.pack()


def _with_sound(text: str, character: Character, added: GltfAdditions, sound: Sound) -> str:
    """The sound as KHR_audio_emitter describes it, beside what the file has of it."""
    record = character.document.record
    data, media = pack_sound(sound)
    view = added.view(data)
    extensions = record.get("extensions", {})
    there = extensions.get(AUDIO, {}) if isinstance(extensions, dict) else None
    parts = [there.get(name, []) if isinstance(there, dict) else None for name in _AUDIO_LISTS]
    scenes, used = record.get("scenes", []), record.get("extensionsUsed", [])
    if not all(isinstance(part, list) for part in (*parts, used)):
        raise _own_form(character)
    audio, sources, emitters = (len(part or ()) for part in parts)
    new = (
        {"bufferView": view, "mimeType": media},
        {"audio": audio, "autoPlay": True, "loop": False},
        {"type": "global", "sources": [sources]},
    )
    text = _with_holder(text, ["extensions"], record)
    text = _with_holder(text, ["extensions", AUDIO], extensions)
    for name, item in zip(_AUDIO_LISTS, new, strict=True):
        text = with_items(text, ["extensions", AUDIO, name], [item])
    shown = record.get("scene", 0)
    if isinstance(shown, int) and not isinstance(shown, bool) and 0 <= shown < len(scenes):
        text = _with_emitter(text, scenes[shown], shown, emitters, character)
    return text if AUDIO in used else with_items(text, ["extensionsUsed"], [AUDIO])


_AUDIO_LISTS = ("audio", "sources", "emitters")


def _with_emitter(
    text: str, scene: dict[str, Any], number: int, emitter: int, character: Character
) -> str:
    own = scene.get("extensions", {})
    there = own.get(AUDIO, {}) if isinstance(own, dict) else None
    if not isinstance(there, dict) or not isinstance(there.get("emitters", []), list):
        raise _own_form(character)
    place = ["scenes", number, "extensions"]
    text = _with_holder(text, place, scene)
    text = _with_holder(text, [*place, AUDIO], own)
    return with_items(text, [*place, AUDIO, "emitters"], [emitter])


def _with_holder(text: str, path: list[str | int], above: dict[str, Any]) -> str:
    """The text with an empty object at a path where there is none."""
    return text if path[-1] in above else with_value(text, path, {})


def _own_form(character: Character) -> OutputError:
    found = f"{AUDIO} in a form of its own"
    return OutputError.about(character.name, found=found, allowed="its specification's")
