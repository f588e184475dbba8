"""How much talkers differ: real ones tracked in video, and simulated ones beside them.

    python -m recipes.talker_spread ../shared/data            real talkers: the table that ships
    python -m recipes.talker_spread --simulated 32            people as `RichFace` draws them

Real talkers are those of `talkers/train` and `grid_s1`: speakers with eight clips or more, clips
that are neither turned nor jittery. A speaker's figure is taken over all clips; the spread between
speakers is what is left of its standard deviation when the error of sampling clips, by bootstrap,
is taken away. Lengths are in distances of the outer eye corners. The figures are typed into
`recipes.rich_faces.talker_spread`; no clip is.

Simulated people all say the same sentences in one voice and the plain style, so what differs
between them is what was drawn. Needs espeak-ng.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array
from elocute.articulation.style import STYLES
from elocute.audio.waveform import Waveform
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.speech.text.known_phones import posteriors_from_phones
from recipes.encoder.store import LABEL_RATE, RATE
from recipes.rich_faces import talker_spread
from recipes.rich_faces.rich_face import RichFace, RichTake

FLAWS = {"small_mouth", "turned", "jittery"}
CLIPS_MIN, FRAMES_MIN = 8, 20
GRID_CLIPS = 200
BOOTSTRAPS = 100
PEAK_SHARE = 0.25  # an opening rises so much of a clip's range above its least
FPS = 25.0
SENTENCES = (
    "Please bring me a cup of coffee before the meeting starts.",
    "The farmer's wife often picks wild berries by the river.",
    "Which of those five old shoes would you choose to throw away?",
    "He thought she was joking about the purple elephant.",
    "Bob and Mary moved to a bigger house near the beach.",
    "You can measure the value of good food by how people feel.",
)
# What is measured in a clip, and how a speaker's clips become one figure.
FIGURES: dict[str, str] = {
    "opening": "deviation",
    "width": "deviation",
    "jaw": "deviation",
    "tilt": "deviation",
    "sideways": "deviation",
    "opening_mean": "mean",
    "opening_least": "mean",
    "width_mean": "mean",
    "openings_per_s": "mean",
}


def clip_figures(
    opening: Float64Array,
    width: Float64Array,
    jaw: Float64Array,
    corners: Float64Array,
    fps: float,
) -> dict[str, float]:
    """Of one clip: variances of what moves, means of what stays.

    All (frame,) in distances of the eye corners; corners (frame, 2, 2), x and y of both.
    """
    return {
        "opening": float(opening.var()),
        "width": float(width.var()),
        "jaw": float(jaw.var()),
        "tilt": float((corners[:, 0, 1] - corners[:, 1, 1]).var()),
        "sideways": float(corners[:, :, 0].mean(axis=1).var()),
        "opening_mean": float(opening.mean()),
        "opening_least": float(np.percentile(opening, 5)),
        "width_mean": float(width.mean()),
        "openings_per_s": _peaks(opening) / (len(opening) / fps),
    }


def _peaks(opening: Float64Array) -> int:
    smooth = np.convolve(opening, [0.25, 0.5, 0.25], "same")
    rise = np.diff(smooth)
    high = smooth[1:-1] > opening.min() + PEAK_SHARE * np.ptp(opening)
    return int(((rise[:-1] > 0) & (rise[1:] <= 0) & high).sum())


def real_talkers(data: Path) -> dict[str, list[dict[str, float]]]:
    """Figures of each clip by speaker."""
    room = data / "talkers" / "train"
    paths = defaultdict(list)
    for clip in json.loads((room / "manifest.json").read_text(encoding="utf-8"))["clips"]:
        if clip["speaker"].startswith("ar_") and not FLAWS & set(clip.get("flags", ())):
            paths[clip["speaker"]].append(room / clip["npz"])
    paths["grid"] = sorted((data / "grid_s1" / "clips").glob("*.npz"))[:GRID_CLIPS]
    found = {
        who: [each for path in files for each in _tracked(path)] for who, files in paths.items()
    }
    return {who: clips for who, clips in found.items() if len(clips) >= CLIPS_MIN}


def _tracked(path: Path) -> Iterator[dict[str, float]]:
    with np.load(path) as clip:
        seen = clip["valid"].astype(bool) & np.isfinite(clip["inner_opening_mean"])
        if seen.sum() < FRAMES_MIN:
            return
        eyes = float(np.asarray(clip["eye_dist_px"]).ravel()[0])
        places = list(clip["lip_idx"])
        corners = clip["lip_xyz"][seen][:, [places.index(61), places.index(291)], :2] / eyes
        opening, width, jaw = (
            clip[n][seen].astype(float) for n in ("inner_opening_mean", "lip_width", "jaw")
        )
        yield clip_figures(opening, width, jaw, corners.astype(float), float(clip["fps"]))


def take_figures(take: RichTake) -> dict[str, float]:
    """The same of a simulated take, from its vertices."""
    head = take.face.head
    vertices = take.vertices().astype(float)
    eyes = take.face.template[head.landmarks[[36, 45]]]
    vertices /= np.linalg.norm(eyes[1] - eyes[0])
    third = len(head.inner_lip_upper) // 3
    upper, lower = head.inner_lip_upper[third:-third], head.inner_lip_lower[third:-third]
    opening = np.maximum(vertices[:, upper, 1] - vertices[:, lower, 1], 0).mean(axis=1)
    corners = vertices[:, head.outer_corners]
    width = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    jaw = -vertices[:, head.landmarks[8], 1]
    return clip_figures(opening, width, jaw, corners[..., :2], take.fps)


def simulated_talkers(people: int) -> dict[str, list[dict[str, float]]]:
    """Figures of takes by person."""
    from recipes.encoder.synthesise import Espeak

    head, voice = load_builtin_head(), Espeak()
    spoken = [voice.speak(text, "en-us", 165, 50, 50) for text in SENTENCES]
    found = {}
    for number in range(people):
        person = RichFace(head, resolve_identity(str(number)), STYLES["plain"], seed=number)
        takes = []
        for index, (samples, phones) in enumerate(spoken):
            duration = len(samples) / RATE
            takes.append(
                person.take(
                    posteriors_from_phones(phones, duration, LABEL_RATE),
                    LABEL_RATE,
                    frame_count=round(duration * FPS),
                    fps=FPS,
                    sound=Waveform(samples, RATE),
                    name=str(index),
                )
            )
        found[str(number)] = [take_figures(take) for take in takes]
    return found


def spreads(talkers: dict[str, list[dict[str, float]]]) -> dict[str, tuple[float, float]]:
    """The median over talkers, and the standard deviation between them of the logarithm."""
    rng = np.random.default_rng(1)
    found = {}
    for name, kind in FIGURES.items():
        of = _figure(kind)
        tables = [np.array([clip[name] for clip in clips]) for clips in talkers.values()]
        logs = np.array([of(values) for values in tables])
        errors = [
            np.std([of(v[rng.integers(len(v), size=len(v))]) for _ in range(BOOTSTRAPS)])
            for v in tables
        ]
        between = max(0.0, float(logs.var(ddof=1) - np.mean(np.square(errors))))
        found[name] = float(np.exp(np.median(logs))), between**0.5
    return found


def _figure(kind: str) -> Callable[[Float64Array], float]:
    if kind == "deviation":
        return lambda values: 0.5 * float(np.log(max(values.mean(), 1e-9)))
    return lambda values: float(np.log(max(values.mean(), 1e-3)))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path, nargs="?", help="folder with talkers and grid_s1")
    parser.add_argument("--simulated", type=int, default=0, help="so many simulated people")
    choice = parser.parse_args()
    print("| | typical | spread | typical, as shipped | spread |\n|---|---|---|---|---|")
    for talkers in (
        real_talkers(choice.data) if choice.data else {},
        simulated_talkers(choice.simulated) if choice.simulated else {},
    ):
        for name, (typical, spread) in (spreads(talkers) if talkers else {}).items():
            real = talker_spread.REAL_TALKERS[name]
            print(f"| {name} | {typical:.4f} | {spread:.3f} | {real[0]:.4f} | {real[1]:.3f} |")
        if talkers:
            print(f"{len(talkers)} talkers, {sum(map(len, talkers.values()))} clips")


if __name__ == "__main__":
    main()
