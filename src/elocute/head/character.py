"""A character in a file of its own: what in it the built-in head's curves and joints move.

The file is never taken apart for this. Its morph targets and joints are moved where they are, so
meshes may be compressed in any way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.files.json_records import as_record, finite_number, parse_json
from elocute.meshes.gltf_document import GltfDocument, gltf_document, morph_targets

VERSION = 1
RECORD_MAX_BYTES = 20_000_000
SHARE_MAX = 100.0
DEGREES_MAX = 180.0
ALLOWED = "a character that `elocute head adopt` stored"
_FILE, _RECORD = "character/file", "character/record"


@dataclass(frozen=True)
class Control:
    """Morph targets of a file that move together.

    Attributes
    ----------
    name : str
        What the file calls them.
    looks : dict of str to float
        What they do at weight one, as weights of the built-in head's curves.
    binds : tuple of (int, int, float)
        Mesh, morph target and its weight where the control is at one; () for one that turns a
        joint.
    shares : dict of str to float
        Its weight is this share of each curve, added up; {} where it is fitted.
    switch : bool
        Whether it is only ever off or on.
    overrides : dict of str to str
        What it takes away of others, as expressions of a VRM 1.0 do: "block" or "blend" by
        "blink", "lookAt" and "mouth".
    """

    name: str
    looks: dict[str, float]
    binds: tuple[tuple[int, int, float], ...]
    shares: dict[str, float] = field(default_factory=dict)
    switch: bool = False
    overrides: dict[str, str] = field(default_factory=dict)

    @property
    def fitted(self) -> bool:
        """Whether its weight is fitted to the mouth, frame by frame."""
        return not self.shares


@dataclass(frozen=True)
class Turn:
    """The joint `node` of a file, and what turns it.

    `joints` are those of the built-in head whose turns it takes, the outermost first; `controls`
    are degrees of nod and turn at weight one, by the name of a control.
    """

    node: int
    joints: tuple[str, ...]
    controls: dict[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Character:
    """A glTF file whose face is moved by the built-in head's curves.

    `name` is what messages call it: the name of its file. `nodes` are those whose meshes are moved,
    `controls` their morph targets, `turns` its joints. `facing_deg` is how far its face is turned
    about +Y from +Z, before both are turned about +X by `tilt_deg`: by 90 where +Z is up. `notes`
    say which shapes and meshes nothing moves. Raises HeadError where these name what the file does
    not have.
    """

    name: str
    document: GltfDocument = field(repr=False)
    nodes: tuple[int, ...]
    controls: tuple[Control, ...]
    turns: tuple[Turn, ...] = ()
    facing_deg: float = 0.0
    notes: tuple[str, ...] = ()
    tilt_deg: float = 0.0

    def __post_init__(self) -> None:
        meshes = {self._mesh_of(node) for node in self.nodes}
        for control in self.controls:
            for mesh, target, _ in control.binds:
                if mesh not in meshes or not 0 <= target < self.target_count(mesh):
                    raise _unfit(self.name, f"{control.name!r} of mesh {mesh}, target {target}")
        names = [control.name for control in self.controls]
        if len(set(names)) != len(names):
            raise HeadError.about(self.name, found="a control twice", allowed="each once")
        for turn in self.turns:
            if not set(turn.controls) <= set(names):
                raise _unfit(self.name, "control of a joint")
            if not 0 <= turn.node < len(self.document.records("nodes")):
                raise _unfit(self.name, f"node {turn.node}")

    def _mesh_of(self, node: int) -> int:
        nodes = self.document.records("nodes")
        if not 0 <= node < len(nodes) or "mesh" not in nodes[node]:
            raise _unfit(self.name, f"node {node}")
        return nodes[node]["mesh"]

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) from the built-in head's axes to the scene's."""
        angles = np.radians([self.facing_deg, self.tilt_deg])
        (sine, up), (cosine, flat) = np.sin(angles), np.cos(angles)
        turned = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        return np.array([[1, 0, 0], [0, flat, -up], [0, up, flat]]) @ turned

    @cached_property
    def meshes(self) -> tuple[int, ...]:
        """The meshes that are moved, each once."""
        return tuple(dict.fromkeys(self._mesh_of(node) for node in self.nodes))

    def target_count(self, mesh: int) -> int:
        """How many morph targets a mesh has."""
        return len(morph_targets(self.document.records("meshes")[mesh]))

    def arrays(self) -> dict[str, NDArray[np.uint8]]:
        """What an .npz stores: the file as it is, and the mapping as JSON."""
        import json

        record = {
            "version": VERSION,
            "name": self.name,
            "nodes": self.nodes,
            "controls": [vars(control) for control in self.controls],
            "turns": [vars(turn) for turn in self.turns],
            "facing_deg": self.facing_deg,
            "tilt_deg": self.tilt_deg,
            "notes": self.notes,
        }
        return {
            _FILE: np.frombuffer(self.document.data, np.uint8),
            _RECORD: np.frombuffer(json.dumps(record).encode(), np.uint8),
        }


def character_of_arrays(stored: Mapping[str, NDArray[Any]]) -> Character | None:
    """The character that `Character.arrays` stored in arrays of an .npz; None where it has none.

    Raises HeadError for a mapping or a file that is damaged.
    """
    if _FILE not in stored and _RECORD not in stored:
        return None
    file, raw = stored.get(_FILE), stored.get(_RECORD)
    if file is None or raw is None or file.dtype != np.uint8 or raw.nbytes > RECORD_MAX_BYTES:
        raise HeadError(f"a character without its file or its mapping; allowed: {ALLOWED}")
    record = as_record(
        parse_json(raw.tobytes(), "character", allowed=ALLOWED, error=HeadError),
        "character",
        ALLOWED,
        HeadError,
    )
    if record.get("version") != VERSION:
        raise HeadError.about("character", found="another version", allowed=f"version {VERSION}")
    name = _text(record.get("name"))
    return Character(
        name,
        gltf_document(file.tobytes(), name, error=HeadError),
        tuple(_whole(each) for each in _list(record.get("nodes"))),
        tuple(_control(each) for each in _list(record.get("controls"))),
        tuple(_turn(each) for each in _list(record.get("turns"))),
        _number(record.get("facing_deg"), 360.0),
        tuple(_text(each) for each in _list(record.get("notes", []))),
        _number(record.get("tilt_deg", 0.0), 360.0),
    )


def _control(record: Any) -> Control:
    entry = as_record(record, "character", ALLOWED, HeadError)
    binds = []
    for bind in _list(entry.get("binds")):
        mesh, target, share = _list(bind) if len(_list(bind)) == 3 else (None,) * 3
        binds.append((_whole(mesh), _whole(target), _number(share, SHARE_MAX)))
    return Control(
        _text(entry.get("name")),
        _shares(entry.get("looks")),
        tuple(binds),
        _shares(entry.get("shares")),
        entry.get("switch") is True,
        {name: _text(way) for name, way in _overrides(entry).items()},
    )


def _overrides(record: dict[str, Any]) -> dict[str, Any]:
    return as_record(record.get("overrides", {}), "character", ALLOWED, HeadError)


def _turn(record: Any) -> Turn:
    entry = as_record(record, "character", ALLOWED, HeadError)
    controls = {}
    for name, degrees in as_record(entry.get("controls"), "turn", ALLOWED, HeadError).items():
        pair = [_number(each, DEGREES_MAX) for each in _list(degrees)]
        if len(pair) != 2:
            raise _damaged()
        controls[name] = (pair[0], pair[1])
    joints = tuple(_text(each) for each in _list(entry.get("joints")))
    return Turn(_whole(entry.get("node")), joints, controls)


def _shares(record: Any) -> dict[str, float]:
    entry = as_record(record, "character", ALLOWED, HeadError)
    return {_text(name): _number(share, SHARE_MAX) for name, share in entry.items()}


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise _damaged()
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise _damaged()
    return value


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise _damaged()
    return value


def _number(value: Any, most: float) -> float:
    number = finite_number(value)
    if number is None or abs(number) > most:
        raise _damaged()
    return number


def _damaged() -> HeadError:
    return HeadError(f"a character whose mapping is damaged; allowed: {ALLOWED}")


def _unfit(name: str, found: str) -> HeadError:
    return HeadError.about(name, found=f"no {found} to move", allowed="what the file holds")
