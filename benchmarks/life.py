"""Heads and lids of tracked people beside those that Elocute moves to the same sound.

    python -m benchmarks.life ../shared/data            # people who only judge
    python -m benchmarks.life ../shared/data --train    # those that rates and sizes were set by

The sounds of a speaker are joined and animated at once; what comes out is cut where the clips were,
so both sides are measured in the same way on the same pieces.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.head.builtin import load_builtin_head
from elocute.life.director import ACCENT, BLINK, LOOK_DOWN, LOOK_LEFT
from elocute.life.face import HELD, head_turns, rows_of_frames
from elocute.life.moods import NEUTRAL
from elocute.life.prosody import ROW_RATE, ProsodyStream
from elocute.life.prosody_events import EventFinder, Syllable
from elocute.life.settings import Life
from elocute.life.stream import LifeStream
from elocute.motion.motion import Motion

Floats = NDArray[np.float64]

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
RATE = 16000
BANDS_HZ = ((0.0, 0.5), (0.5, 2.0), (2.0, 5.0), (5.0, 8.0))
SHORT_S = 1.2  # the length of the shortest clips
PAUSE_DB, SPEECH_DB = -30.0, -25.0  # of the loudest: below it nobody speaks, above it somebody does
AWAY_DEG = 8.0  # that eyes are off the listener
FROZEN_WEIGHT, FROZEN_M = 1e-4, 1e-6  # what moves no further from frame to frame stands still
MOUTHS, MOUTH_S = 4, 60.0  # speakers of a source, and of each one's sound, that mouths are made for
CORNERS = (291, 61)  # of tracked mouths: left and right
UPPER_FACE = (
    "browInnerUp",
    "browOuterUpLeft",
    "browDownLeft",
    "eyeWideLeft",
    "eyeSquintLeft",
    "cheekSquintLeft",
)
RAISED = 0.15  # of browInnerUp, a millimetre
SHUT, OPEN = 0.45, 0.30  # lid closure that a blink exceeds, and that it begins and ends at
JITTER_MAX, EYES_MIN_PX = 0.005, 60.0  # of the clips of small faces


@dataclass
class Source:
    """Clips of one source; speakers are kept apart."""

    name: str
    window_s: float
    speakers: dict[str, list[Path]] = field(default_factory=dict)


@dataclass
class Piece:
    """A clip's head and lids: degrees (frame, 3), lid closure (frame,), loudness in dB.

    gaze: (frame,) degrees off the listener, where it is known. mouth: (frame, 2) mm, how far
    corners are to the left together, and the left one above the right one.
    """

    pose: Floats
    closure: Floats
    loudness: Floats
    fps: float
    gaze: Floats | None = None
    mouth: Floats | None = None


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path, help="the data folder")
    parser.add_argument("--train", action="store_true", help="the people that may teach")
    given = parser.parse_args()
    sources = train_sources(given.data) if given.train else dev_sources(given.data)
    print(
        "| | blinks/min | half shut, s | std in 1.2 s, ° | 95 % of turns, ° | < 0.5 Hz |"
        " 0.5–2 Hz | 2–5 Hz | 5–8 Hz | speed with loudness | nod with loudness |"
        " range of turns, ° | gaze off, % | mouth aside, uneven, mm |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for source in sources:
        people: list[Piece] = []
        ours: list[Piece] = []
        for place, clips in enumerate(source.speakers.values()):
            seen, made = both(clips, place < MOUTHS)
            people += seen
            ours += made
        print(row(f"{source.name}, people", people, source.window_s))
        print(row(f"{source.name}, ours", ours, source.window_s), flush=True)
    print("\n| frames that stand still, % | 25 | 30 | 60 frames/s |\n|---|---|---|---|")
    noise = np.random.default_rng(0).normal(0, 0.02, 20 * RATE).astype(np.float32)
    silence = Waveform(np.zeros(20 * RATE, np.float32), RATE)
    for name, sound in (
        ("digital silence, 20 s", silence),
        ("noise, 20 s", Waveform(noise, RATE)),
        ("pauses of the example", read_audio(EXAMPLE, sample_rate=RATE)),
    ):
        told = " | ".join(f"{100 * frozen(sound, fps):.1f}" for fps in (25, 30, 60))
        print(f"| {name} | {told} |", flush=True)
    talk = given.data / "talkers" / "dev" / "clips" / "edtalk_pose2.ogg"
    print(f"\n| | accents/min | with a raise | raises/min | {' | '.join(UPPER_FACE)} |")
    print(f"|---|---|---|---|{'---|' * len(UPPER_FACE)}")
    for name, path in (("example", EXAMPLE), ("one man, English", talk)):
        print(upper_face(name, read_audio(path, sample_rate=RATE)), flush=True)
    sound = read_audio(EXAMPLE)
    whole, live = (cost(sound, block) for block in (len(sound.samples), sound.sample_rate // 100))
    print(f"\nProcessor time: {whole:.4f} s per second of sound, {live:.4f} in blocks of 10 ms")


def cost(sound: Waveform, block: int) -> float:
    """Processor seconds per second of sound."""
    stream, started = LifeStream(sound.sample_rate, Life()), time.process_time()
    for at in range(0, len(sound.samples), block):
        stream.push(sound.samples[at : at + block])
    stream.flush()
    return (time.process_time() - started) / sound.duration_s


def frozen(sound: Waveform, fps: float) -> float:
    """Share of the frames of pauses in which no curve and no vertex of the face moves."""
    motion = animate(sound, fps=fps).motion
    level = loudness(sound, motion.frame_count, fps)
    quiet = (level <= level.max() + PAUSE_DB) | (np.ptp(level) < 10)
    still = np.abs(np.diff(motion.weights, axis=0)).max(axis=1) <= FROZEN_WEIGHT
    for frame in np.flatnonzero(still & quiet[1:]).tolist():
        before, after = motion.vertices(frame, frame + 2)
        still[frame] = np.abs(after - before).max() <= FROZEN_M
    return float(still[quiet[1:]].mean())


def upper_face(name: str, sound: Waveform) -> str:
    """How far shapes go (median, 95 %, most), and how often the brows go up with an accent."""
    finder, events = EventFinder(), []
    for batch in ProsodyStream().push(sound.samples):
        events += finder.push(batch)
    accents = [e.row for e in events if isinstance(e, Syllable) and e.prominence >= ACCENT]
    curves = animate(sound).curves
    brows, fps = curves["browInnerUp"], curves.fps
    raises = raised(brows, round(0.3 * fps))
    met = [np.abs(raises / fps - row / ROW_RATE).min(initial=1.0) < 0.25 for row in accents]
    minutes = sound.duration_s / 60
    shapes = [
        " ".join(f"{v:.2f}" for v in np.percentile(curves[name], [50, 95, 100]))
        for name in UPPER_FACE
    ]
    told = (
        f"{len(accents) / minutes:.0f}",
        f"{100 * np.mean(met):.0f} %",
        f"{len(raises) / minutes:.0f}",
        *shapes,
    )
    return f"| {name} | {' | '.join(told)} |"


def raised(brows: NDArray[np.float32], within: int) -> NDArray[np.intp]:
    """Frames where brows are highest after they rose by `RAISED` at least."""
    found, last = [], -within
    for frame in range(1, len(brows) - 1):
        lowest = brows[max(0, frame - within) : frame + 1].min()
        highest = brows[max(0, frame - within) : frame + within].max()
        if brows[frame] == highest > lowest + RAISED and frame - last >= within:
            found.append(frame)
            last = frame
    return np.array(found, np.intp)


def train_sources(data: Path) -> list[Source]:
    held_out = set((data / "grid_s1" / "dev.txt").read_text().split())
    grid = [p for p in sorted((data / "grid_s1" / "clips").glob("*.npz")) if p.stem not in held_out]
    news = Source("news, Arabic", SHORT_S)
    for clip in _manifest(data / "talkers" / "train"):
        arabic = clip["id"].startswith("ar_")
        if arabic and clip["jitter"] < JITTER_MAX and clip["eye_px"] > EYES_MIN_PX:
            place = data / "talkers" / "train" / "clips" / f"{clip['id']}.npz"
            news.speakers.setdefault(clip["speaker"], []).append(place)
    return [Source("GRID, train", 3.0, {"s1": grid}), news]


def dev_sources(data: Path) -> list[Source]:
    names = sorted((data / "grid_s1" / "dev.txt").read_text().split())
    grid = [data / "grid_s1" / "clips" / f"{name}.npz" for name in names]
    found = [Source("GRID, dev", 3.0, {"s1": grid})]
    for start, name, window_s in (
        ("edtalk", "one man, English", 6.0),
        ("astorfi", "one man, turned", 6.0),
        ("romajaku", "syllables, Polish", 2.4),
    ):
        clips = [
            data / "talkers" / "dev" / "clips" / f"{clip['id']}.npz"
            for clip in _manifest(data / "talkers" / "dev")
            if clip["id"].startswith(start)
        ]
        found.append(Source(name, window_s, {name: clips}))
    return found


def _manifest(folder: Path) -> list[dict]:
    return json.loads((folder / "manifest.json").read_text())["clips"]


def both(clips: Sequence[Path], mouths: bool) -> tuple[list[Piece], list[Piece]]:
    """What the clips of one speaker show, and what is made of their sounds, joined."""
    sounds = [read_audio(clip.with_suffix(".ogg"), sample_rate=RATE) for clip in clips]
    stream = LifeStream(RATE, Life())
    rows = [stream.push(sound.samples) for sound in sounds]
    joined = np.concatenate([sound.samples for sound in sounds])[: round(MOUTH_S * RATE)]
    mouth = uneven(animate(Waveform(joined, RATE)).motion) if mouths else np.zeros((0, 2))
    made = np.concatenate([*rows, stream.flush()])
    seen, ours, start = [], [], 0
    for clip, sound in zip(clips, sounds, strict=True):
        piece = tracked(clip, sound)
        if piece is not None:
            count, fps = len(piece.pose), piece.fps
            # Where the joined sound has this clip, at the clip's own frames.
            own = rows_of_frames(made, 0, round(start / RATE * fps), count, fps)
            turns = head_turns(own, Life(), NEUTRAL)
            gaze = own[:, [LOOK_DOWN, LOOK_LEFT]] + (1 - HELD) * turns[:, :2]
            shown = round(60 * start / RATE) + np.round(np.arange(count) * 60 / fps).astype(int)
            ours.append(
                Piece(
                    turns,
                    own[:, BLINK].astype(float),
                    piece.loudness,
                    fps,
                    np.linalg.norm(gaze, axis=1),
                    mouth[shown] if shown[-1] < len(mouth) else None,
                )
            )
            seen.append(piece)
        start += len(sound.samples)
    return seen, ours


def tracked(clip: Path, sound: Waveform) -> Piece | None:
    """A tracked clip; None where the face was lost."""
    with np.load(clip) as stored:
        fps, eyes = float(stored["fps"]), np.asarray(stored["eye_open"], float)
        pose = np.asarray(stored["pose_deg"], float)
        lips, points = np.asarray(stored["lip_xyz"], float), list(stored["lip_idx"])
        lips = 1000 * load_builtin_head().eye_distance_m * lips / stored["eye_dist_px"].ravel()[0]
    if not (np.isfinite(pose).all() and np.isfinite(eyes).all()):
        return None
    closure = 1 - eyes / np.percentile(eyes, 85)
    left, right = (lips[:, points.index(corner)] for corner in CORNERS)
    mouth = np.stack([(left + right)[:, 0] / 2, (left - right)[:, 1]], axis=1)
    return Piece(pose, closure, loudness(sound, len(pose), fps), fps, mouth=mouth)


def uneven(motion: Motion) -> Floats:
    """(frame, 2) mm: how far an animated mouth is aside, and one corner above the other."""
    corners = motion.head.landmarks[[54, 48]]
    basis = motion.head.expression_basis[:, corners].astype(float)
    left, right = np.moveaxis(np.einsum("fs,spx->fpx", motion.weights, basis), 1, 0)
    return 1000 * np.stack([(left + right)[:, 0] / 2, (left - right)[:, 1]], axis=1)


def loudness(sound: Waveform, count: int, fps: float) -> Floats:
    """(frame,) dB of the 100 ms around each frame, at most 40 below the loudest."""
    power = np.concatenate([[0.0], np.cumsum(np.square(sound.samples, dtype=np.float64))])
    middle = np.arange(count) / fps * RATE
    first, last = (np.clip(middle + step * RATE, 0, len(power) - 1) for step in (-0.05, 0.05))
    mean = (power[last.astype(int)] - power[first.astype(int)]) / np.maximum(last - first, 1)
    level = 10 * np.log10(mean + 1e-12)
    return np.maximum(level, level.max() - 40)


def row(name: str, pieces: Sequence[Piece], window_s: float) -> str:
    found = [blink for piece in pieces for blink in blinks(piece)]
    seconds = sum(len(piece.pose) / piece.fps for piece in pieces)
    # Clips shorter than a blink's interval show how often, on average, but not how regularly.
    rate = f"{60 * len(found) / seconds:.0f}"
    half = f"{np.median([width for _, width in found]):.2f}" if found else "–"
    short = [part.std(axis=0) for piece in pieces for part in windows(piece, SHORT_S)]
    away = np.concatenate([np.abs(p.pose - np.median(p.pose, axis=0)) for p in pieces])
    power = np.array([bands(part, p.fps) for p in pieces for part in windows(p, window_s)])
    rms = np.sqrt(power.mean(axis=0))
    cells = [axes(rms[band]) if window_s * BANDS_HZ[band][1] >= 2 else "–" for band in range(4)]
    spoken = [p.loudness > p.loudness.max() + SPEECH_DB for p in pieces]
    gaze = [
        p.gaze[at] > AWAY_DEG for p, at in zip(pieces, spoken, strict=True) if p.gaze is not None
    ]
    mouths = [p.mouth.std(axis=0) for p in pieces if p.mouth is not None]
    told = (
        rate,
        half,
        axes(np.sqrt(np.mean(np.square(short), axis=0))),
        axes(np.percentile(away, 95, axis=0)),
        *cells,
        f"{together(pieces):.2f}",
        f"{nodding(pieces):.2f}",
        f"{np.median([np.ptp(p.pose[:, 1]) for p in pieces]):.1f}",
        f"{100 * np.concatenate(gaze).mean():.0f}" if gaze else "–",
        axes(np.mean(mouths, axis=0)),
    )
    return f"| {name} | {' | '.join(told)} |"


def axes(values: Floats) -> str:
    return " ".join(f"{value:.2f}" for value in values)


def windows(piece: Piece, seconds: float) -> Iterator[Floats]:
    count = round(seconds * piece.fps)
    for start in range(0, len(piece.pose) - count + 1, count):
        yield piece.pose[start : start + count]


def bands(part: Floats, fps: float) -> Floats:
    """(band, axis) mean square in degrees² of what is left without a straight line."""
    count = len(part)
    line = np.linspace(-1, 1, count)[:, None]
    left = part - part.mean(axis=0)
    left = left - line * (line * left).sum(axis=0) / (line * line).sum()
    spectrum = np.fft.rfft(left * np.hanning(count)[:, None], axis=0) / count
    power = 2 * np.abs(spectrum) ** 2 / np.mean(np.hanning(count) ** 2)
    hz = np.fft.rfftfreq(count, 1 / fps)
    return np.stack([power[(low < hz) & (hz <= high)].sum(axis=0) for low, high in BANDS_HZ])


def blinks(piece: Piece) -> list[tuple[float, float]]:
    """When lids shut, s, and for how long they were at least half as far, s."""
    closure, found, at = piece.closure, [], 0
    while at < len(closure):
        if closure[at] <= SHUT:
            at += 1
            continue
        end = at
        while end < len(closure) and closure[end] > OPEN:
            end += 1
        peak = at + int(closure[at:end].argmax())
        left = right = peak
        while left > 0 and closure[left - 1] > closure[peak] / 2:
            left -= 1
        while right + 1 < len(closure) and closure[right + 1] > closure[peak] / 2:
            right += 1
        found.append((peak / piece.fps, (right - left + 1) / piece.fps))
        at = end
    return found


def together(pieces: Sequence[Piece]) -> float:
    """Mean correlation, over clips, of how fast a head turns with how loud its owner speaks."""
    found = []
    for piece in pieces:
        speed = np.linalg.norm(np.gradient(piece.pose, axis=0), axis=1)
        smooth = np.ones(max(1, round(0.2 * piece.fps)))
        speed, loud = (
            np.convolve(x, smooth / len(smooth), "valid") for x in (speed, piece.loudness)
        )
        if speed.std() > 0 and loud.std() > 0:
            found.append(np.corrcoef(speed, loud)[0, 1])
    return float(np.mean(found))


def nodding(pieces: Sequence[Piece]) -> float:
    """Size of the mean correlation, over clips, of how far a head nods with loudness."""
    moved = [p for p in pieces if p.pose[:, 0].std() > 0 and p.loudness.std() > 0]
    return abs(float(np.mean([np.corrcoef(p.pose[:, 0], p.loudness)[0, 1] for p in moved])))


if __name__ == "__main__":
    main()
