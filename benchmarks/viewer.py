"""The viewer's page: its size, when its first frame is there and when it is sharp, how fast it
draws, and how far its picture is from that of a film.

    python -m benchmarks.viewer [--people ada,esi] [--size 800]

In a headless Chromium, whose graphics are software (SwiftShader).
"""

from __future__ import annotations

import argparse
import io
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from elocute.animation import animate
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.head.looks import PEOPLE
from elocute.motion.motion import Motion
from tests.support.browser import headless_browser, open_viewer

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
AT_S = 2.5
FINISHED = """
const gl = document.querySelector('canvas').getContext('webgl2'), one = new Uint8Array(4);
const done = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one);
"""


def first_frame_s(driver: Any, page: Path) -> float:
    """From asking for the page until its head is drawn."""
    open_viewer(driver, page)
    return driver.execute_script("return performance.getEntriesByName('drawn')[0].startTime") / 1000


def sharp_s(driver: Any) -> float:
    """From asking for the page until its picture has all its pixels: the first has fewer."""
    whole = "elocute.renderer.getPixelRatio() === Math.min(devicePixelRatio, 2)"
    while not driver.execute_script(f"return {whole}"):
        time.sleep(0.02)
    return driver.execute_script(f"{FINISHED} done(); return performance.now()") / 1000


def frame_ms(driver: Any) -> tuple[float, list[int]]:
    """Of another pose, and the canvas's size in pixels."""
    return tuple(
        driver.execute_script(
            f"{FINISHED} const started = performance.now();"
            "for (let k = 0; k < 8; k++) { elocute.jump(1 + 0.1 * k); elocute.show(); done(); }"
            "const c = document.querySelector('canvas');"
            "return [(performance.now() - started) / 8, [c.width, c.height]];"
        )
    )


def drawn(driver: Any) -> np.ndarray:
    raw = driver.execute_async_script(
        f"const told = arguments[0]; elocute.jump({AT_S}); elocute.show();"
        "setTimeout(() => { elocute.show(); document.querySelector('canvas').toBlob(async (b) =>"
        "told(Array.from(new Uint8Array(await b.arrayBuffer())))); }, 2500);"
    )
    return np.asarray(Image.open(io.BytesIO(bytes(raw))).convert("RGBA")).astype(int)


def filmed(motion: Motion, size: tuple[int, int]) -> np.ndarray:
    dressed, frame = motion.dressed(), round(AT_S * motion.fps)
    with open_pictures(dressed.head, size, PictureOptions()) as renderer:
        points = next(iter(dressed.vertices(frame, frame + 1)))
        return renderer.frame(points.astype(np.float32)).astype(int)


def need(there: object, what: str) -> None:
    if not there:
        raise SystemExit(f"needs {what}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--people", default=",".join(name for name in PEOPLE if name != "mean"))
    parser.add_argument("--size", type=int, default=800)
    chosen = parser.parse_args()
    print(
        f"{'':8}{'MB':>6}{'first s':>9}{'sharp s':>9}{'frame ms':>10}{'apart':>7}"
        "  mean difference of 255"
    )
    with tempfile.TemporaryDirectory() as folder:
        for who in chosen.people.split(","):
            page = Path(folder) / f"{who}.html"
            take = animate(EXAMPLE, identity=who)
            take.write(page)
            window = f"{chosen.size},{chosen.size}"
            with headless_browser(need, Path(folder) / f"profile-{who}", window) as driver:
                driver.set_script_timeout(120)
                first = first_frame_s(driver, page)
                sharp = sharp_s(driver)
                each, size = frame_ms(driver)
                ours = drawn(driver)
            theirs = filmed(take.motion, (ours.shape[1], ours.shape[0]))
            apart = np.abs(ours[..., :3] - theirs)[ours[..., 3] == 255].mean()
            megabytes = page.stat().st_size / 1e6
            print(
                f"{who:8}{megabytes:6.1f}{first:9.1f}{sharp:9.1f}{each:10.0f}{apart:7.1f}  {size}",
                flush=True,
            )


if __name__ == "__main__":
    main()
