"""Reports how a character's file was understood, in words and as a record."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from elocute.adoption.characters.open_character import OpenedCharacter
from elocute.export.character_weights import measured_mouth
from elocute.head.character import Control
from elocute.motion.curves import ARKIT_NAMES

FITTED, JOINT = "fitted", "joint: "
MOUTHS = {
    "direct": "ARKit's shapes, moved by the curves as they are",
    "fitted": "fitted to the built-in head's mouth, frame by frame",
}
MEASURED = {True: "opened as far as its own mesh wants it", False: "no lips that part in its mesh"}


def character_record(opened: OpenedCharacter) -> dict[str, Any]:
    """The mapping of a character as plain values, which JSON can hold."""
    character, mapping = opened.character, opened.mapping
    nodes = character.document.records("nodes")
    taken = {curve for control in character.controls for curve in control.looks}
    own = measured_mouth(character)
    return {
        "meshes": {mesh.name: len(mesh.targets) for mesh in opened.meshes},
        "mouth": f"{MOUTHS[mapping.mouth]}; {MEASURED[own is not None]}",
        "mapped": {control.name: _takes(control) for control in character.controls},
        "joints": {
            str(nodes[turn.node].get("name", turn.node)): " + ".join(turn.joints)
            for turn in character.turns
        },
        "facing_deg": round(character.facing_deg, 1),
        "tilt_deg": round(character.tilt_deg, 1),
        "given": mapping.given,
        "idle": mapping.idle,
        "unknown": mapping.unknown,
        "still": list(opened.still),
        "notes": list(character.notes),
        "missing": [name for name in ARKIT_NAMES if name not in taken],
    }


def report_lines(record: dict[str, Any]) -> Iterable[str]:
    """A record of `character_record` as lines for people."""
    meshes = ", ".join(f"{name} ({count} shapes)" for name, count in record["meshes"].items())
    yield _line("meshes", meshes)
    yield _line("mouth", record["mouth"])
    mapped = record["mapped"]
    for title, kept in (
        ("mapped", lambda name, takes: not name.startswith(JOINT) and takes[:6] != FITTED),
        ("fitted", lambda _, takes: takes[:6] == FITTED),
        ("by joints", lambda name, _: name.startswith(JOINT)),
    ):
        names = [name for name, takes in mapped.items() if kept(name, takes)]
        if names:
            yield _line(title, f"{len(names)}: " + ", ".join(_taken(n, mapped[n]) for n in names))
    joints = [f"{name} ({joint})" for name, joint in record["joints"].items()]
    yield _line("joints", ", ".join(joints) or "none: the head does not turn")
    yield from _listed("given", dict.fromkeys(record["given"], ""))
    yield from _listed("idle", {n: f" ({why})" for n, why in record["idle"].items()})
    meant = {n: f" (near {near})" if near else "" for n, near in record["unknown"].items()}
    yield from _listed("unknown", meant)
    if record["still"]:
        yield _line("still", ", ".join(record["still"]) + ": without shapes and joints that move")
    yield _line("missing", ", ".join(record["missing"]) or "none of ARKit's")


def _taken(name: str, takes: str) -> str:
    """A shape, and what it takes where its name does not say so."""
    if name.startswith(JOINT):
        return name.removeprefix(JOINT)
    return name if takes == name or takes.startswith(FITTED) else f"{name} ({takes})"


def _takes(control: Control) -> str:
    """What a control takes."""
    shares = " + ".join(
        name if share == 1 else f"{share:.2g} {name}"
        for name, share in (control.shares or control.looks).items()
    )
    return shares if control.shares else f"{FITTED}, as {shares}"


def _listed(title: str, names: dict[str, str]) -> Iterable[str]:
    if names:
        yield _line(title, ", ".join(f"{name}{more}" for name, more in names.items()))


def _line(title: str, text: str) -> str:
    return f"{title:12} {text}"
