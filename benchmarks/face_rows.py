"""Rows of small pictures of mouths: people's tracked lips, and what models make of the same sound.

Each row shows the same moments. A row of a person draws the outlines of the lips as the tracker
saw them, from the front, in the scale of the head's pictures; over it stand the phones as the
encoder hears them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from elocute.array_types import Float64Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.corpus.importers.grid import FIELDS_MAX_BYTES
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import PHONES
from elocute.files.array_reading import read_npz
from elocute.files.reading import FileKind
from elocute.motion.motion import Motion
from elocute.render import open_renderer, portrait

LIPS_FILE = FileKind("a tracked clip with its lips", FIELDS_MAX_BYTES)
FACES_A_ROW, FACE = 18, 77  # pictures, pixels
LIPS, INSIDE = (196, 120, 112), (60, 25, 25)
LIPS_WIDTH = 1.25  # of a picture that the eye corners' distance fills, as in the head's pictures
CROP = (0.2, 0.32, 0.8, 0.92)  # of a picture of the mouth: lips and what moves with them
# Points of MediaPipe's face mesh around the lips, from the left corner over the upper lip.
OUTER = (
    *(61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291),
    *(375, 321, 405, 314, 17, 84, 181, 91, 146),
)
INNER = (
    *(78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308),
    *(324, 318, 402, 317, 14, 87, 178, 88, 95),
)


@dataclass(frozen=True, eq=False)
class TrackedLips:
    """(frame, point, 2) places in outer eye-corner distances, y down, at (frame,) times in s."""

    times_s: Float64Array
    outer: Float64Array
    inner: Float64Array


def read_tracked_lips(clip: Path, offset_s: float) -> TrackedLips:
    """The lips of a tracked clip, moved by how late they are against the sound."""
    stored = read_npz(clip, LIPS_FILE, only=frozenset(("t", "lip_xyz", "lip_idx", "eye_dist_px")))
    order = {int(point): place for place, point in enumerate(stored["lip_idx"])}
    flat = stored["lip_xyz"][:, :, :2].astype(float) / float(stored["eye_dist_px"].ravel()[0])
    middle = np.nanmedian(flat, axis=(0, 1))
    outer, inner = (flat[:, [order[point] for point in ring]] - middle for ring in (OUTER, INNER))
    return TrackedLips(stored["t"].astype(float) - offset_s, outer, inner)


def shown_frames(motion: Motion, first_s: float, count: int, step: int) -> list[int]:
    """`count` frames of the motion from a time on, `step` apart, as far as it goes."""
    first = round(first_s * motion.fps)
    return [f for f in range(first, first + count * step, step) if f < motion.frame_count]


def model_faces(motion: Motion, frames: Sequence[int]) -> list[Image.Image]:
    """The mouth of the head at each frame."""
    head = motion.head
    side = 4 * FACE
    with open_renderer(head, (side, side), camera=portrait(head, "mouth")) as renderer:
        pictures = [renderer.frame(motion.vertices(f, f + 1)[0]) for f in frames]
    left, top, right, bottom = (round(share * side) for share in CROP)
    box = (left, top, right, bottom)
    return [Image.fromarray(picture).crop(box).resize((FACE, FACE)) for picture in pictures]


def lip_faces(lips: TrackedLips, times_s: Float64Array) -> list[Image.Image]:
    """The tracked lips at the frame nearest to each time."""
    return [_lips_at(lips, int(np.abs(lips.times_s - time).argmin())) for time in times_s]


def _lips_at(lips: TrackedLips, frame: int) -> Image.Image:
    large = 4 * FACE
    image = Image.new("RGB", (large, large), (232, 232, 232))
    draw = ImageDraw.Draw(image)
    for ring, colour in ((lips.outer[frame], LIPS), (lips.inner[frame], INSIDE)):
        if np.isfinite(ring).all():
            draw.polygon([tuple(p) for p in (ring * LIPS_WIDTH + 0.5) * large], fill=colour)
    return image.resize((FACE, FACE))


def phones_heard(sound: Path, times_s: Float64Array) -> list[str]:
    """The phone that the encoder hears at each time, "" in silence."""
    samples = read_audio(sound, sample_rate=SPEECH_RATE).samples
    heard = builtin_encoder().encode(samples).argmax(axis=1)
    rows = np.minimum(np.round(np.asarray(times_s) * 50).astype(int), len(heard) - 1)
    return ["" if PHONES[heard[row]] == "SIL" else PHONES[heard[row]] for row in rows]


def sheet_rows(
    rows: Sequence[tuple[str, Sequence[Image.Image]]],
    phones: Sequence[str],
    times_s: Float64Array,
    width: int,
) -> list[Image.Image]:
    """Strips of pictures, a strip of each row, then the next times; labels stand at the left."""
    strips = []
    for start in range(0, len(times_s), FACES_A_ROW):
        part = slice(start, start + FACES_A_ROW)
        head = Image.new("RGB", (width, 16), "white")
        for k, phone in enumerate(phones[part]):
            ImageDraw.Draw(head).text((k * FACE + 30, 2), phone, fill=(20, 20, 20))
        ImageDraw.Draw(head).text((2, 2), f"{times_s[start]:.2f}", fill=(120, 120, 120))
        strips.append(head)
        for label, faces in rows:
            strip = Image.new("RGB", (width, FACE), "white")
            for k, face in enumerate(faces[part]):
                strip.paste(face, (k * FACE, 0))
            ImageDraw.Draw(strip).text((3, 2), label, fill=(20, 20, 20))
            strips.append(strip)
    return strips
