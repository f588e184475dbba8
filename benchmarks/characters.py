"""Characters with shapes of their own: what fits leave of the mouth.

    python -m benchmarks.characters [--ict FaceXModel] [--makehuman makehuman]

Shapes by their names alone are told on the built-in head; characters on their own meshes, in the
built-in head's size: those of the tests, ICT-FaceKit's head, and MakeHuman's.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import elocute
from elocute.adoption.characters.open_character import character_of
from elocute.errors import HeadError
from elocute.export.character_weights import character_motion, measured_mouth, mouth_controls
from elocute.head.character import Character
from elocute.head.preset_shapes import OCULUS_SHAPES, SILENT, VRM_MOUTH
from elocute.meshes.gltf_document import gltf_document
from elocute.motion.control_fit import builtin_mouth, fit_controls, is_of_mouth, is_whole_mouth
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.mouth_seam import SHARES
from tests.support import strange_heads

EXAMPLE = Path(elocute.__file__).parent / "assets" / "example.flac"
USED = 0.02
SEALED = 0.495  # of mouthPress: lips shut for a p, b or m
OPEN_MM = 2.0
MIDDLE = slice(2, 5)  # of the places where the gap is measured
WITHOUT_CLOSE = [name for name in ARKIT_NAMES if name.startswith(("jaw", "mouth", "tongue"))]
WITHOUT_CLOSE.remove("mouthClose")
SETS: dict[str, list[dict[str, float]]] = {
    "15 visemes of Oculus": [look for name, look in OCULUS_SHAPES.items() if name != SILENT],
    "5 vowels of a VRM": list(VRM_MOUTH.values()),
    "ARKit without `mouthClose`": [{name: 1.0} for name in WITHOUT_CLOSE],
    "a jaw alone": [{"jawOpen": 1.0}],
}
ICT_SHAPES = ("jawOpen", "mouthClose", "mouthFunnel", "mouthPucker", "mouthSmile_L", "mouthSmile_R")
MAKEHUMAN_SHAPES = {
    "jawOpen": "mouth-open",
    "mouthPucker": "mouth-pursing",
    "mouthSmile": "mouth-corner-puller",
    "mouthPress": "mouth-compression",
    "mouthFunnel": "mouth-protusion",
    "mouthStretch": "mouth-retraction",
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--ict", type=Path, help="ICT-FaceKit's folder FaceXModel")
    parser.add_argument("--makehuman", type=Path, help="MakeHuman's folder data")
    given = parser.parse_args()
    motion = elocute.animate(EXAMPLE, life=0).motion
    by_names(motion)
    print(
        "\n| character | fitted by | opening r | size | gap at seals, mm | width r | size "
        "| jaw r | size | sum | largest step |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, data in characters(given.ict, given.makehuman).items():
        document = gltf_document(data, name, error=HeadError)
        on_its_mesh(name, motion, character_of(document, Path("face.glb"), None, {}).character)


def by_names(motion: Motion) -> None:
    """Shapes whose mesh is not known."""
    own = measure_mouth(motion)["opening_mm"]
    print(
        "| shapes | skin off, mm | opening off, mm | r | size | closed, mm at most "
        "| shapes at a time | largest step |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, looks in SETS.items():
        fit = fit_controls(motion, looks)
        mixes = np.stack([motion.head.expression_vector(look) for look in looks])
        had = measure_mouth(replace(motion, weights=fit.weights @ mixes))["opening_mm"]
        print(
            f"| {name} | {fit.skin_mm:.2f} | {fit.opening_mm:.2f} "
            f"| {np.corrcoef(had, own)[0, 1]:.3f} | {had.std() / own.std():.2f} "
            f"| {fit.closed_mm:.2f} | {(fit.weights > USED).sum(axis=1).mean():.1f} "
            f"| {np.abs(np.diff(fit.weights, axis=0)).max():.2f} |"
        )
    step = np.abs(np.diff(motion.weights, axis=0)).max()
    print(f"\nThe motion's own curves step by {step:.2f} at most.")


def characters(ict: Path | None, makehuman: Path | None) -> dict[str, bytes]:
    """Files by what they are."""
    points, triangles = strange_heads.face()
    wide = strange_heads.viseme_shapes(1.5)
    spelled = {"ih": "I", "oh": "O", "ou": "U"}
    oculus = {f"viseme_{spelled.get(name, name)}": shape for name, shape in wide.items()}
    vowels = dict(zip("AIUEO", (wide[n] for n in ("aa", "ih", "ou", "E", "oh")), strict=True))
    drawn, sheet, shapes = strange_heads.drawn_face()
    anime = {f"Fcl_MTH_{name}": shape for name, shape in shapes.items()}
    found = {
        "ARKit, jaw × 1.6, `mouthClose` of 0.85": (strange_heads.arkit_shapes(1.6, 0.85)),
        "ARKit, jaw × 0.6, `mouthClose` of 1.2": strange_heads.arkit_shapes(0.6, 1.2),
        "Oculus, jaw × 1.5": oculus,
        "five vowels, jaw × 1.5": vowels,
    }
    files = {name: strange_heads.character(points, triangles, each) for name, each in found.items()}
    files["VRoid's vowels, a drawn face"] = strange_heads.character(drawn, sheet, anime)
    if ict is not None:
        files["ICT-FaceKit, six of ARKit's"] = ict_file(ict)
    if makehuman is not None:
        files["MakeHuman's face units as ARKit's"] = makehuman_file(makehuman)
    return files


def ict_file(folder: Path) -> bytes:
    from recipes.heads_speak import ict_parts

    points, faces, _ = ict_parts(folder)

    def read(name: str) -> np.ndarray:
        lines = (folder / f"{name}.obj").read_text(encoding="utf-8").splitlines()
        return np.array(
            [[float(n) for n in line.split()[1:4]] for line in lines if line[:2] == "v "]
        )

    used = ("M_Face", "M_BackHead", "M_GumsTongue", "M_Teeth")
    shapes = {name: read(name) - points for name in ICT_SHAPES}
    return strange_heads.character(points, np.concatenate([faces[each] for each in used]), shapes)


def makehuman_file(folder: Path) -> bytes:
    points, faces, group = [], [], ""
    for line in (folder / "3dobjs" / "base.obj").read_text(encoding="utf-8").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "g":
            group = words[0]
        elif kind == "f" and (group == "body" or "teeth" in group or "tongue" in group):
            a, b, c, d = (int(word.split("/")[0]) - 1 for word in words)
            faces += [[a, b, c], [a, c, d]]
    shapes = {}
    for name, target in MAKEHUMAN_SHAPES.items():
        shapes[name] = np.zeros((len(points), 3))
        file = folder / "targets/expression/units/caucasian" / f"{target}.target"
        for line in file.read_text(encoding="utf-8").splitlines():
            if line and not line.startswith("#"):
                row, *moved = line.split()
                shapes[name][int(row)] = [float(each) for each in moved]
    return strange_heads.character(np.array(points), np.array(faces), shapes)


def on_its_mesh(name: str, motion: Motion, face: Character) -> None:
    """A row for the names alone, and one for the mesh."""
    own, mouth = measured_mouth(face), mouth_controls(face)
    assert own is not None
    curves = tuple(each for each in motion.head.expression_names if is_of_mouth(each))
    ours, columns = builtin_mouth(curves), [motion.head.expression_index(each) for each in curves]
    scale = 1000 * ours.width / own.width
    take = 1000 * motion.weights[:, columns] @ ours.effects
    wanted = np.maximum(take[:, MIDDLE].mean(axis=1), 0)
    looks = [each.looks for each in mouth]
    moved = character_motion(motion, face).controls
    measured = np.stack([moved[each.name] for each in mouth], axis=1)
    if mouth[0].fitted:
        named = fit_controls(motion, looks).weights
    else:
        shares = np.array([[each.shares.get(curve, 0.0) for each in mouth] for curve in curves])
        named = np.minimum(motion.weights[:, columns] @ shares, 1)
    whole = np.array([is_whole_mouth(look) and mouth[0].fitted for look in looks])
    shut = motion.weights[:, motion.names.index("mouthPressLeft")] > SEALED
    for how, weights in (("names", named), ("its mesh", measured)):
        had = scale * (weights @ own.effects + np.pad(own.gaps, (0, 2)))
        gap, count = had[:, MIDDLE].mean(axis=1), len(SHARES)
        cells = [
            *_agreement(gap, wanted, wanted > OPEN_MM),
            f"{had[shut][:, MIDDLE].max():.2f}",
            *_agreement(had[:, count], take[:, count]),
            *_agreement(had[:, count + 1], take[:, count + 1]),
            f"{weights[:, whole].sum(axis=1).max():.2f}" if whole.any() else "",
            f"{np.abs(np.diff(weights, axis=0)).max():.2f}",
        ]
        print(f"| {name} | {how} | {' | '.join(cells)} |")


def _agreement(had: np.ndarray, wanted: np.ndarray, used: np.ndarray | None = None) -> list[str]:
    """Correlation, and size as a share of what is wanted."""
    part = np.ones(len(had), bool) if used is None else used
    size = (had * wanted)[part].sum() / np.square(wanted[part]).sum()
    return [f"{np.corrcoef(had, wanted)[0, 1]:.3f}", f"{size:.2f}"]


if __name__ == "__main__":
    main()
