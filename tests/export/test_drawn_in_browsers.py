"""Characters as our pictures, our page and three.js show them."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from benchmarks.drawn_characters import PROGRAM, SIDE, compare
from elocute.animation import animate
from elocute.render.shading import to_srgb
from tests.support import strange_heads
from tests.support.browser import headless_browser, open_viewer
from tests.support.strange_heads import UNLIT, painted, rigged
from tests.support.three_js import open_program

pytestmark = [pytest.mark.browser, pytest.mark.system]


@pytest.fixture(scope="module")
def face():
    points, triangles = strange_heads.face()
    return points, triangles, strange_heads.arkit_shapes()


def test_three_js_plays_what_we_draw(face, need, speech_wav, tmp_path):
    """The file that is written, by its animation: another way to a picture."""
    vowels = strange_heads.drawn_face()
    files = {
        "back.glb": rigged(face, turn=(0, np.pi, 0), scale=(100.0, 100.0, 100.0)),
        "drawn.glb": strange_heads.character(*vowels),
    }
    with open_program(need, PROGRAM % {"side": SIDE}, tmp_path) as driver:
        for name, data in files.items():
            (tmp_path / name).write_bytes(data)
            record, _ = compare(driver, tmp_path / name, speech_wav)
            assert record["silhouette"] > 0.985 and record["outline_px"] < 3, record


def test_the_page_shows_its_colours(face, need, speech_wav, tmp_path):
    (tmp_path / "hero.glb").write_bytes(painted(face, [0.2, 0.5, 0.8, 1], **UNLIT))
    animate(speech_wav, head=tmp_path / "hero.glb").write(tmp_path / "take.html")
    with headless_browser(need, tmp_path / "profile") as driver:
        open_viewer(driver, tmp_path / "take.html")
        url = driver.execute_script(
            "elocute.jump(0.5); elocute.show();"
            "return document.querySelector('canvas').toDataURL('image/png')"
        )
        errors = [each for each in driver.get_log("browser") if each["level"] == "SEVERE"]
    with Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))) as image:
        picture = np.asarray(image.convert("RGBA")).astype(int)
    wanted = 255 * to_srgb(np.array([[0.2, 0.5, 0.8]], np.float32))[0]
    alike = np.abs(picture[..., :3] - wanted).max(axis=2) <= 2
    assert alike.mean() > 0.2 and not errors
