"""Frames a second of the renderers, bare and dressed heads, and of a video with its sound.

    python -m benchmarks.drawing                       # every renderer that works here
    python -m benchmarks.drawing --backend moderngl --pictures build/drawing

A frame is the vertices of a moving face, drawn and read back; the fastest of three rounds counts,
and beside it stands what a frame took of a processor: that says more beside other work.
Pictures of the last frames are kept where a folder is named: two machines should draw the same.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from elocute.animation import animate
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.motion.motion import Motion

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
SIZES = ((800, 800), (1920, 1080))
PEOPLE = ("ada", "ben", "esi", "otto")
FRAMES = {"moderngl": 30, "embreex": 2}
ROUNDS = 3


def driver() -> str:
    """What draws for moderngl here; "" where nothing does."""
    try:
        from elocute.render.gl import describe

        return describe()
    except Exception as error:  # whatever the driver raises
        print(f"moderngl: {error}")
        return ""


def rate_of(
    motion: Motion, size: tuple[int, int], options: PictureOptions, keep: Path | None
) -> tuple[float, float]:
    """Frames a second, vertices among it, of the fastest round; least processor ms of a frame."""
    count, rates, works, pictures = FRAMES[options.backend], [], [], []
    with open_pictures(motion.head, size, options) as renderer:
        renderer.frame(motion.vertices(59, 60)[0])
        for _ in range(ROUNDS):
            begun, work = time.perf_counter(), time.process_time()
            pictures = list(renderer.frames(motion.faces(60, 60 + count)))
            rates.append(count / (time.perf_counter() - begun))
            works.append(1000 * (time.process_time() - work) / count)
    if keep:
        from PIL import Image

        keep.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(pictures[-1]).save(keep)
    return max(rates), min(works)


def video_rate(motion: Motion, size: tuple[int, int], backend: str) -> float:
    """Frames a second of a whole .mp4 with sound."""
    from elocute.export.video import write_video

    with tempfile.TemporaryDirectory() as room:
        begun = time.perf_counter()
        options = PictureOptions(size=size, backend=backend)
        write_video(motion, f"{room}/talk.mp4", sound=EXAMPLE, options=options)
        return motion.frame_count / (time.perf_counter() - begun)


def measured(
    backend: str,
    quality: str,
    people: Sequence[str],
    sizes: Sequence[tuple[int, int]],
    pictures: Path | None,
) -> None:
    bare = animate(EXAMPLE, fps=30, look=None).motion
    heads = {"bare": bare} | {
        name: animate(EXAMPLE, fps=30, identity=name).motion.dressed() for name in people
    }
    for size in sizes:
        options = PictureOptions(size=size, backend=backend, quality=quality)
        shown = "x".join(map(str, size))
        for name, motion in heads.items():
            keep = pictures / f"{backend}_{quality}_{size[1]}_{name}.png" if pictures else None
            rate, work = rate_of(motion, size, options, keep)
            row = f"| {name}, {backend}, {quality}, {shown} | {rate:.3g} frames/s | {work:.0f} ms |"
            print(row, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--backend", choices=tuple(FRAMES), help="this one alone")
    parser.add_argument("--quality", choices=("draft", "fast", "high"), action="append")
    parser.add_argument("--pictures", type=Path, help="keep the last frames here")
    parser.add_argument("--people", default=",".join(PEOPLE))
    parser.add_argument("--small", action="store_true", help="at 800x800 alone")
    choice = parser.parse_args()
    sizes = SIZES[:1] if choice.small else SIZES
    name = driver()
    print(
        f"moderngl draws with {name or 'nothing'}\n\n| what | measured | processor |\n|---|---|---|"
    )
    backends = (choice.backend,) if choice.backend else ("moderngl", "embreex")
    for backend in backends:
        if backend == "moderngl" and not name:
            continue
        for quality in choice.quality or ("fast", "high"):
            measured(backend, quality, choice.people.split(","), sizes, choice.pictures)
    motion = animate(EXAMPLE, fps=30, identity="ada").motion
    for size in sizes:
        shown = "x".join(map(str, size))
        rate = video_rate(motion, size, choice.backend or "auto")
        print(f"| .mp4 of ada with sound, {shown} | {rate:.3g} frames/s | |", flush=True)


if __name__ == "__main__":
    main()
