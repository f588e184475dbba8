"""Adds a talking animation to a character's own glTF file; the rest stays as it was.

What is added are items at the ends of lists (animation, accessors, buffer views) and bytes at the
end of the buffer; every other letter of the JSON and every byte of the buffer stays where it was.
A node that is given as a matrix and moves becomes a shift, a turn and a scale, since no other can
be animated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elocute.errors import OutputError
from elocute.export.character_weights import CharacterMotion, character_motion, conversion_record
from elocute.export.gltf_file import Channels
from elocute.export.soundtrack import Sound, pack_sound
from elocute.head.character import Character
from elocute.meshes.gltf_additions import GltfAdditions, with_items, with_value
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_nodes import without_matrix
from elocute.motion.motion import Motion

NAME = "speech"
ADDED_MAX_BYTES = 2_000_000_000
AUDIO = "KHR_audio_emitter"


def character_glb(motion: Motion, character: Character, sound: Sound | None = None) -> bytes:
    """A character's file with a motion of the built-in head as one more animation, as a .glb.

    Raises OutputError for a motion so long that no .glb holds it.
    """
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
    animation = speech.animation(_free_name(character.document))
    text = with_items(text, ["animations"], [animation | {"extras": {"elocute": record}}])
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


def _free_name(document: GltfDocument) -> str:
    """`speech`, or with a number where there is an animation of that name."""
    taken = {each.get("name") for each in document.records("animations") if each}
    number, name = 1, NAME
    while name in taken:
        number += 1
        name = f"{NAME} {number}"
    return name


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
