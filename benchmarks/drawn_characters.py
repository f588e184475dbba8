"""Characters as we draw them, against three.js, which plays the very file that `animate` writes.

    python -m benchmarks.drawn_characters hero.glb avatar.vrm [--sound speech.wav] [--sheet s.png]

For each character, at the worst of a few moments: how much of what either silhouette covers both
cover, and how far outlines are apart. The camera is ours; three.js runs in a headless Chromium
with its own GLTFLoader and a plain light.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from elocute.animation import animate
from elocute.export.drawn_character import drawn, placement
from elocute.export.gltf_character import character_glb
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.motion.motion import Motion
from elocute.render.camera import Camera, portrait
from tests.support.three_js import open_program

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
SIDE = 400
MOMENTS = 4
PROGRAM = """
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
const renderer = new THREE.WebGLRenderer({
  alpha: true, preserveDrawingBuffer: true, antialias: true,
});
renderer.setSize(%(side)d, %(side)d);
document.body.append(renderer.domElement);
const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
window.open_file = async (text, matrix, eye, target, field) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { scene, animations } = await loader.parseAsync(bytes.buffer, "");
  const stage = new THREE.Scene(), group = new THREE.Group();
  group.matrixAutoUpdate = false;
  group.matrix.fromArray(matrix);
  group.add(scene);
  const key = new THREE.DirectionalLight(0xffffff, 2.2);
  key.position.set(-0.5, 0.6, 1);
  stage.add(group, new THREE.AmbientLight(0xffffff, 1.6), key);
  scene.traverse((each) => { each.frustumCulled = false; });
  const camera = new THREE.PerspectiveCamera(field, 1, 0.05, 50);
  camera.position.fromArray(eye);
  camera.lookAt(...target);
  const mixer = new THREE.AnimationMixer(scene);
  const clip = animations.filter(({ name }) => name.startsWith("speech")).at(-1);
  mixer.clipAction(clip).play();
  window.show = (time) => {
    mixer.setTime(time);
    renderer.render(stage, camera);
    return renderer.domElement.toDataURL("image/png");
  };
  return true;
};
window.ready = true;
"""


def three_pictures(
    driver: Any, motion: Motion, camera: Camera, times: Sequence[float]
) -> list[NDArray[np.uint8]]:
    """(side, side, 4) pictures that three.js draws of the file that is written."""
    character = motion.head.character
    assert character is not None
    text = base64.b64encode(character_glb(motion, character)).decode()
    matrix = placement(character).T.ravel().tolist()
    place = [camera.position.tolist(), camera.target.tolist(), camera.field_deg]
    driver.set_script_timeout(180)
    arguments = ", ".join(json.dumps(each) for each in (matrix, *place))
    driver.execute_script("window.text = ''")
    for start in range(0, len(text), 4_000_000):
        driver.execute_script("window.text += arguments[0]", text[start : start + 4_000_000])
    driver.execute_async_script(
        f"const done = arguments[0]; window.open_file(window.text, {arguments})"
        ".then(done, (error) => done(String(error)));"
    )
    pictures = []
    for time in times:
        url = driver.execute_script(f"return window.show({time})")
        with Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))) as image:
            pictures.append(np.asarray(image.convert("RGBA")))
    return pictures


def our_pictures(motion: Motion, frames: Sequence[int]) -> list[NDArray[np.uint8]]:
    """(side, side, 4) pictures of our own."""
    options = PictureOptions(background="transparent")
    with open_pictures(motion.head, (SIDE, SIDE), options) as renderer:
        return [renderer.frame(motion.vertices(at, at + 1)[0]) for at in frames]


def shared(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Share of what either covers that both cover."""
    return float((one & other).sum() / max((one | other).sum(), 1))


def outline_px(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """How far the pixels that only one covers are from the other's, at the 99th hundredth."""
    from scipy.ndimage import distance_transform_edt

    def beside(mask: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> NDArray[np.float64]:
        return np.asarray(distance_transform_edt(~wanted))[mask & ~wanted]

    away = np.concatenate([beside(one, other), beside(other, one)])
    return float(np.percentile(away, 99)) if len(away) else 0.0


def compare(driver: Any, file: Path, sound: Path) -> tuple[dict[str, Any], Image.Image]:
    """Figures of a character, and its pictures: ours above, three.js' below."""
    motion = animate(sound, head=file).motion
    head = drawn(motion)
    frames = np.linspace(0, motion.frame_count - 1, MOMENTS + 2).round().astype(int)[1:-1]
    ours = our_pictures(head, frames.tolist())
    times = [frame / motion.fps for frame in frames]
    theirs = three_pictures(driver, motion, portrait(head.head), times)
    masks = [(a[..., 3] > 127, b[..., 3] > 127) for a, b in zip(ours, theirs, strict=True)]
    record = {
        "character": file.name,
        "silhouette": min(shared(*pair) for pair in masks),
        "outline_px": max(outline_px(*pair) for pair in masks),
    }
    sheet = Image.new("RGB", (SIDE * MOMENTS, 2 * SIDE), (110, 118, 128))
    for row, pictures in enumerate((ours, theirs)):
        for column, picture in enumerate(pictures):
            image = Image.fromarray(picture)
            sheet.paste(image, (SIDE * column, SIDE * row), image)
    return record, sheet


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--sound", type=Path, default=EXAMPLE)
    parser.add_argument("--sheet", type=Path)
    chosen = parser.parse_args()

    def need(there: object, what: str) -> None:
        if not there:
            raise SystemExit(f"needs {what}")

    sheets = []
    with (
        tempfile.TemporaryDirectory() as folder,
        open_program(need, PROGRAM % {"side": SIDE}, Path(folder)) as driver,
    ):
        for file in chosen.files:
            record, sheet = compare(driver, file, chosen.sound)
            print(json.dumps(record), flush=True)
            sheets.append(sheet)
    if chosen.sheet:
        whole = Image.new("RGB", (sheets[0].width, sum(each.height for each in sheets)))
        for row, each in enumerate(sheets):
            whole.paste(each, (0, row * each.height))
        whole.save(chosen.sheet)


if __name__ == "__main__":
    main()
