"""Faces of flesh: are lips shut where they should be, do they go through anything, what does a face
have that no rig has, and what does each part of it add.

    python -m benchmarks.rich_faces [--people 12] [--ablation]
    python -m benchmarks.rich_faces --sheet sheet.png     pictures of both, and where they differ

Each person is drawn from a seed and says the same sentences, by espeak-ng. Lips are measured as the
tests of the head do: the gap along the contact lines, and how deep the deepest lip vertex lies in
the convex hull of a tooth (needs SciPy).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from elocute.array_types import FloatArray, IntArray
from elocute.articulation.style import STYLES
from elocute.audio.waveform import Waveform
from elocute.export.pictures import contact_sheet
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.model import HeadModel
from elocute.render import open_renderer, portrait
from elocute.speech.text.known_phones import posteriors_from_phones
from recipes.corpus.subjects import SUBJECTS
from recipes.encoder.store import LABEL_RATE, RATE
from recipes.encoder.synthesise import Espeak, Phones
from recipes.rich_faces.rich_face import FaceRichness, RichFace, RichTake
from recipes.talker_spread import SENTENCES

FPS = 30.0
TEETH_EVERY = 5  # frames
HELD_OUT = 4  # of the people, the last
COMPONENTS = 28
Spoken = list[tuple[np.ndarray, Phones]]


def spoken(sentences: int) -> Spoken:
    voice = Espeak()
    return [voice.speak(text, "en-us", 165, 50, 50) for text in SENTENCES[:sentences]]


def people(count: int, richness: FaceRichness) -> Iterator[RichFace]:
    head = load_builtin_head()
    for number in range(count):
        style = STYLES[SUBJECTS[number % len(SUBJECTS)].style]
        yield RichFace(head, resolve_identity(str(200 + number)), style, richness, 200 + number)


def take_of(person: RichFace, said: tuple[np.ndarray, Phones], name: str) -> RichTake:
    samples, phones = said
    duration = len(samples) / RATE
    return person.take(
        posteriors_from_phones(phones, duration, LABEL_RATE),
        LABEL_RATE,
        frame_count=round(duration * FPS),
        fps=FPS,
        sound=Waveform(samples, RATE),
        name=name,
    )


def gap_mm(head: HeadModel, vertices: FloatArray) -> FloatArray:
    """(frame, column) upper minus lower contact height; negative where the lips overlap."""
    upper, lower = vertices[..., head.inner_lip_upper, 1], vertices[..., head.inner_lip_lower, 1]
    return 1000 * (upper - lower)


def in_teeth_mm(head: HeadModel, vertices: FloatArray) -> float:
    """How deep the deepest lip vertex of a frame (vertex, 3) lies inside a crown's hull."""
    from scipy.spatial import ConvexHull

    lips, depth = vertices[np.unique(head.lip_rings[:9])].astype(float), 0.0
    for jaw in ("upper", "lower"):
        for crown in vertices[head.regions[f"teeth_{jaw}"]].reshape(14, -1, 3):
            if (crown.max(0) < lips.min(0)).any() or (crown.min(0) > lips.max(0)).any():
                continue
            planes = ConvexHull(crown).equations
            inside = -(lips @ planes[:, :3].T + planes[:, 3]).max(1)
            depth = max(depth, float(inside.max()))
    return 1000 * depth


def contacts(count: int, said: Spoken) -> None:
    """Gaps at p, b and m, overlap of the lips, and lips in teeth: rich faces and the rig."""
    head = load_builtin_head()
    rows: dict[str, list[list[float]]] = {"rich": [], "rig": []}
    seconds = frames = 0.0
    for person in people(count, FaceRichness()):
        assert len(person.fields)  # made once, and not part of the time of a frame
        for number, each in enumerate(said):
            begun = time.process_time()
            take = take_of(person, each, str(number))
            moved = take.vertices()
            seconds, frames = seconds + time.process_time() - begun, frames + len(moved)
            rig = person.bare + np.tensordot(take.curves.values, head.expression_basis, 1)
            shut = [round((a + b) / 2 * FPS) for a, b, phone in each[1] if phone in "PBM"]
            for name, vertices in (("rich", moved), ("rig", rig)):
                gaps = gap_mm(head, vertices)
                teeth = max(in_teeth_mm(head, v) for v in vertices[::TEETH_EVERY])
                rows[name].append([gaps[shut].max(initial=0.0), -gaps.min(), teeth])
    print("| | widest gap at p, b, m | deepest overlap of the lips | lips in teeth |")
    print("|---|---|---|---|")
    for name, found in rows.items():
        worst = np.max(found, axis=0)
        print(f"| {name} | " + " | ".join(f"{value:.2f} mm" for value in worst) + " |")
    print(f"{1000 * seconds / frames:.1f} ms of CPU a frame, {frames:.0f} frames")


def displacements(count: int, said: Spoken, richness: FaceRichness) -> list[FloatArray]:
    """(frame, number) m of each person, every other frame."""
    found = []
    for person in people(count, richness):
        takes = [take_of(person, each, str(number)) for number, each in enumerate(said)]
        moved = np.concatenate([take.vertices()[::2] - person.template for take in takes])
        found.append(moved.reshape(len(moved), -1))
    return found


def enough(moved: FloatArray, share: float = 0.999) -> int:
    """Components that hold a share of the squared displacement."""
    values = np.sort(np.linalg.eigvalsh((moved @ moved.T).astype(float)))[::-1]
    return int(np.searchsorted(np.cumsum(values) / values.sum(), share)) + 1


def left_mm(moved: FloatArray, basis: FloatArray, region: IntArray) -> float:
    """Mean distance in a region that a basis (component, number) leaves."""
    directions = np.linalg.qr(basis.T.astype(float))[0].astype(np.float32)
    left = moved - (moved @ directions) @ directions.T
    return float(1000 * np.linalg.norm(left.reshape(len(left), -1, 3)[:, region], axis=2).mean())


def richness_table(count: int, said: Spoken, ablation: bool) -> None:
    """Components for 99.9 %, and what 28 learned shapes and all of ARKit leave of other people."""
    head = load_builtin_head()
    whole = FaceRichness()
    variants = {"everything": whole}
    if ablation:
        variants |= {f"without {f.name}": replace(whole, **{f.name: 0.0}) for f in fields(whole)}
    face, arkit = head.regions["face"], head.expression_basis.reshape(55, -1)
    print(f"| | 99.9 % | of the face | {COMPONENTS} learned leave, face | ARKit's 55 leave, face |")
    print("|---|---|---|---|---|")
    for name, richness in variants.items():
        moved = displacements(count, said, richness)
        seen, new = np.concatenate(moved[:-HELD_OUT]), np.concatenate(moved[-HELD_OUT:])
        values, vectors = np.linalg.eigh((seen @ seen.T).astype(float))
        top = np.argsort(values)[::-1][:COMPONENTS]
        learned = (vectors[:, top] / np.sqrt(values[top])).T @ seen
        skin = seen.reshape(len(seen), -1, 3)[:, face].reshape(len(seen), -1)
        figures = left_mm(new, learned, face), left_mm(new, arkit, face)
        print(
            f"| {name} | {enough(seen)} | {enough(skin)} | "
            + " | ".join(f"{value:.3f} mm" for value in figures)
            + " |",
            flush=True,
        )


def sheet(path: Path, said: Spoken) -> None:
    """Four people at eight moments: the rich face, the rig's, and how far apart they are."""
    pictures, labels = [], []
    head = load_builtin_head()
    for number, person in enumerate(people(4, FaceRichness())):
        take = take_of(person, said[number % len(said)], "0")
        frames = np.linspace(4, take.frame_count - 6, 8).astype(int)
        rich = [take.vertices(f, f + 1)[0] for f in frames]
        rig = [
            (person.template + np.tensordot(take.curves.values[f], head.expression_basis, 1))
            for f in frames
        ]
        own = take.head
        painted = []
        for a, b in zip(rich, rig, strict=True):
            apart = np.clip(np.linalg.norm(a - b, axis=1) / 0.004, 0, 1)[:, None]
            tint = (1 - apart) * [235, 235, 235] + apart * [220, 30, 30]
            painted.append(replace(own, vertex_color=tint.astype(np.uint8)))
        with open_renderer(own, (300, 300), camera=portrait(own, "mouth")) as renderer:
            pictures += [renderer.frame(v) for v in rich] + [
                renderer.frame(v.astype(np.float32)) for v in rig
            ]
        for face, vertices in zip(painted, rich, strict=True):
            with open_renderer(face, (300, 300), camera=portrait(face, "mouth")) as renderer:
                pictures.append(renderer.frame(vertices))
        labels += ["rich"] * 8 + ["rig"] * 8 + ["apart, red 4 mm"] * 8
    contact_sheet(pictures, labels, 8).save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--people", type=int, default=12)
    parser.add_argument("--sentences", type=int, default=len(SENTENCES))
    parser.add_argument("--ablation", action="store_true", help="each part left out in turn")
    parser.add_argument("--sheet", type=Path, help="only pictures, into a PNG")
    choice = parser.parse_args()
    said = spoken(choice.sentences)
    if choice.sheet:
        sheet(choice.sheet, said)
        return
    contacts(choice.people, said)
    print()
    richness_table(choice.people, said, choice.ablation)


if __name__ == "__main__":
    main()
