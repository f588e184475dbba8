"""USD: a head with blend shapes, joints, images and its sound in one package (.usdz).

The package is a zip without compression whose files begin at multiples of 64 bytes, so that
programs map it into memory. Its layer is text, which every build of USD reads.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, BinaryIO

from elocute.export.gltf import JOINTS
from elocute.export.options import ShapeOptions
from elocute.export.shape_profiles import target_shapes
from elocute.export.soundtrack import Sound, write_wav
from elocute.export.usd_scene import usd_scene
from elocute.files.atomic import write_atomically
from elocute.motion.motion import Motion

ALIGNMENT, ZIP_HEADER, EXTRA_HEADER = 64, 30, 4
PADDING_TAG = 0x1986  # of the extra field whose content is of no meaning
DATE = (1980, 1, 1, 0, 0, 0)  # the same motion gives the same bytes


def write_usdz(
    motion: Motion,
    path: str | Path,
    *,
    sound: Sound | None = None,
    options: ShapeOptions | None = None,
    progress: Any = None,
) -> None:
    """Write an animated head as .usdz, its sound inside; it is written at once.

    Raises OutputError for a place that cannot be written, and visemes of a head that lacks the
    shapes for them; HeadError for a head with an image that is none.
    """
    path, options = Path(path), options or ShapeOptions()
    motion = motion.dressed()
    shapes = target_shapes(motion.head, options.profile, options.visemes)
    joints = tuple(JOINTS.get(name, (name,))[0] for name in motion.head.joint_names)
    with write_atomically(path) as draft:
        wav = None
        if sound is not None:  # beside the draft: a disk that is full is told of this file
            write_wav(sound, draft.with_name("sound.wav"))
            wav = draft.with_name("sound.wav").read_bytes()
        text, files = usd_scene(motion, shapes, joints, wav, path.stem)
        with draft.open("wb") as file:
            _pack(file, {"head.usda": text.encode(), **files})


def _pack(file: BinaryIO, files: dict[str, bytes]) -> None:
    """The first of the files is the layer that is opened."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as package:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, DATE)
            start = file.tell() + ZIP_HEADER + len(name.encode()) + EXTRA_HEADER
            padding = -start % ALIGNMENT
            entry.extra = (
                PADDING_TAG.to_bytes(2, "little") + padding.to_bytes(2, "little") + bytes(padding)
            )
            package.writestr(entry, data)
