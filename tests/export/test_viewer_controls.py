"""What a person does with the viewer, in a real browser: buttons, keys, sizes, files."""

import contextlib
import io
import json
import re
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from elocute.animation import animate
from elocute.export.html import viewer_stage, write_html
from elocute.export.options import HtmlOptions, PictureOptions
from elocute.export.pictures import open_pictures
from tests.support.browser import (
    PATIENCE_S,
    eventually,
    headless_browser,
    open_viewer,
    wait_for_viewer,
)

pytestmark = pytest.mark.browser
AXE = Path(__file__).parents[2] / "web/node_modules/axe-core/axe.min.js"
WORDS = [(0.1, 0.5, "one"), (0.5, 0.9, "two")]


@pytest.fixture(scope="module")
def motion(speech_wav):
    return animate(speech_wav, fps=30, identity="esi").motion


@pytest.fixture(scope="module")
def viewer(motion, speech_wav, need, tmp_path_factory):
    folder = tmp_path_factory.mktemp("viewer")
    write_html(motion, folder / "talk.html", sound=speech_wav, words=WORDS)
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "640,700") as driver:
        saved = folder / "saved"
        driver.execute_cdp_cmd(
            "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(saved)}
        )
        open_viewer(driver, folder / "talk.html")
        driver.saved = saved
        yield driver


@pytest.fixture(autouse=True)
def at_rest(viewer):
    viewer.execute_script("document.getElementById('reset').click(); elocute.show()")


def state(viewer, expression):
    return viewer.execute_script(f"elocute.show(); return {expression}")


def press(viewer, keys):
    viewer.find_element(By.TAG_NAME, "canvas").send_keys(keys)


def place(viewer):
    return np.array(state(viewer, "elocute.camera.camera.position.toArray()"))


def test_it_shows_what_a_picture_shows(viewer, motion):
    """The face of both in the middle of the same view, pixel by pixel; hair on the whole."""
    viewer.execute_script("elocute.jump(2.5); elocute.show()")
    page = canvas(viewer)
    size = (page.shape[1], page.shape[0])
    dressed, frame = motion.dressed(), round(2.5 * motion.fps)
    with open_pictures(dressed.head, size, PictureOptions()) as renderer:
        points = next(iter(dressed.vertices(frame, frame + 1)))
        picture = renderer.frame(points.astype(np.float32)).astype(int)
    assert page[5, 5, 3] == 0  # the ground is the page's own
    face = (slice(size[1] // 3, size[1] * 2 // 3), slice(size[0] * 2 // 5, size[0] * 3 // 5))
    apart = np.abs(page[face][..., :3].astype(int) - picture[face])
    assert apart.mean() < 4
    assert picture[face].mean((0, 1)) == pytest.approx(page[face][..., :3].mean((0, 1)), abs=2.5)
    hair = (slice(size[1] // 4, size[1] * 5 // 16), slice(size[0] * 2 // 5, size[0] * 3 // 5))
    solid = page[hair][..., 3] == 255
    assert solid.mean() > 0.5
    ours, theirs = page[hair][..., :3][solid], picture[hair][solid]
    assert ours.mean(0) == pytest.approx(theirs.mean(0), abs=1.5)


def canvas(viewer) -> np.ndarray:
    """(height, width, 4) of what is drawn."""
    raw = viewer.execute_async_script(
        "const done = arguments[0]; elocute.show(); document.querySelector('canvas').toBlob("
        "async (b) => done(Array.from(new Uint8Array(await b.arrayBuffer()))))"
    )
    return np.asarray(Image.open(io.BytesIO(bytes(raw))).convert("RGBA"))


# Whether the page has the width asked for, and the camera its stage's shape.
SEEN = """
const stage = document.getElementById("stage");
const aspect = stage.clientWidth / stage.clientHeight;
return innerWidth === arguments[0] && Math.abs(elocute.camera.camera.aspect - aspect) < 1e-6;
"""


@contextlib.contextmanager
def sized(viewer, width, height):
    """The window of another size, once the page has seen it; then as it was."""
    try:
        resize(viewer, width, height)
        yield
    finally:
        resize(viewer, 640, 700)


def resize(viewer, width, height):
    viewer.set_window_size(width, height)
    WebDriverWait(viewer, PATIENCE_S).until(lambda _: viewer.execute_script(SEEN, width))


def test_a_turned_head_stays_turned_when_the_window_changes(viewer):
    press(viewer, "ddw")
    turned = place(viewer)
    with sized(viewer, 500, 640):
        assert place(viewer) == pytest.approx(turned, abs=1e-6)
        assert state(viewer, "document.querySelectorAll('#views [aria-pressed=true]').length") == 0


def test_a_view_is_framed_anew_when_the_window_changes(viewer):
    wide = place(viewer)
    with sized(viewer, 320, 900):
        assert np.linalg.norm(place(viewer)) > np.linalg.norm(wide)


def test_views_by_button_and_by_key(viewer):
    front = place(viewer)
    viewer.find_element(By.CSS_SELECTOR, "[data-view=side]").click()
    side = place(viewer)
    assert side[0] > 0.5 * np.linalg.norm(side) > front[0]
    press(viewer, "1")
    assert place(viewer) == pytest.approx(front, abs=1e-6)
    press(viewer, "4")
    pressed = "document.querySelector('#views [aria-pressed=true]').dataset.view"
    assert state(viewer, pressed) == "mouth"


def test_keys_play_step_and_come_nearer(viewer, motion):
    press(viewer, Keys.ARROW_RIGHT)
    assert state(viewer, "elocute.sound.currentTime") == pytest.approx(1 / motion.fps, abs=1e-3)
    press(viewer, Keys.END)
    assert state(viewer, "elocute.sound.currentTime") == pytest.approx(motion.duration_s, abs=0.05)
    press(viewer, Keys.HOME)
    away = np.linalg.norm(place(viewer))
    press(viewer, "=")
    assert np.linalg.norm(place(viewer)) < away
    # A busy browser may take as long for a key as the take lasts.
    viewer.execute_script("elocute.sound.playbackRate = 0.1")
    press(viewer, " ")
    assert state(viewer, "elocute.sound.paused") is False
    press(viewer, " ")
    assert state(viewer, "elocute.sound.paused") is True
    viewer.execute_script("elocute.sound.playbackRate = 1")


def test_reset_stops_at_the_start(viewer):
    front = place(viewer)
    viewer.execute_script("elocute.jump(2); document.getElementById('play').click()")
    press(viewer, "aaa")
    viewer.find_element(By.ID, "reset").click()
    assert state(viewer, "[elocute.sound.paused, elocute.sound.currentTime]") == [True, 0]
    assert place(viewer) == pytest.approx(front, abs=1e-6)


@pytest.mark.parametrize("looping", [False, True])
def test_at_the_end_it_stops_or_begins_again(viewer, motion, looping):
    if looping:
        press(viewer, "l")
    viewer.execute_script(
        "elocute.jump(arguments[0]); document.getElementById('play').click()",
        motion.duration_s - 0.3,
    )
    assert eventually(lambda: state(viewer, "elocute.sound.ended || elocute.sound.currentTime < 5"))
    playing = state(viewer, "document.body.classList.contains('playing')")
    assert playing == looping
    if looping:
        press(viewer, "l")


def test_captions_can_be_put_away(viewer):
    viewer.execute_script("elocute.jump(0.3); elocute.show()")
    captions = viewer.find_element(By.ID, "captions")
    assert captions.text == "one two"
    viewer.find_element(By.ID, "caption").click()
    assert not captions.is_displayed()
    viewer.find_element(By.ID, "caption").click()


def saved_by(viewer, button: str, begins: bytes) -> Path:
    """The file that a button of the menu saves, once it is there."""
    viewer.execute_script("document.getElementById('downloads').open = true")
    viewer.find_element(By.ID, button).click()

    def found():
        return [each for each in files(viewer.saved) if each.read_bytes().startswith(begins)]

    assert eventually(found), f"{button}: {list(files(viewer.saved))}"
    return found()[0]


def files(folder: Path) -> list[Path]:
    done = [each for each in folder.glob("*") if each.suffix != ".crdownload"]
    return [each for each in done if not each.name.startswith(".")]


@pytest.mark.parametrize(
    "button, begins",
    [
        ("get-picture", b"\x89PNG"),
        ("get-head", b"glTF"),
        ("get-curves", b"time_s,"),
        ("get-sound", b""),
    ],
)
def test_what_is_saved_is_whole(viewer, button, begins):
    saved = saved_by(viewer, button, begins)
    assert saved.stem == "talk" and saved.stat().st_size > 10_000
    shutil.rmtree(viewer.saved)
    viewer.find_element(By.TAG_NAME, "canvas").click()
    assert state(viewer, "document.getElementById('downloads').open") is False


def test_the_table_of_curves_is_the_motion(viewer, motion):
    names, *rows = saved_by(viewer, "get-curves", b"time_s,").read_text().splitlines()
    shutil.rmtree(viewer.saved)
    table = np.array([row.split(",") for row in rows], float)
    assert table[:, 0] == pytest.approx(motion.times_s, abs=1e-4)
    for column, name in enumerate(names.split(",")[1:], start=1):
        weights = motion.weights[:, motion.names.index(name)]
        assert table[:, column] == pytest.approx(weights, abs=1e-3)


@pytest.mark.parametrize("size", [(1280, 800), (640, 700), (500, 700)])
def test_menus_and_buttons_stay_inside_the_window(viewer, size):
    with sized(viewer, *size):
        boxes, rows = viewer.execute_script(
            "const open = (on) => document.querySelectorAll('details').forEach(m => m.open = on);"
            "const boxes = (names) => [...document.querySelectorAll(names)].map("
            "each => each.getBoundingClientRect()).filter(box => box.width);"
            "open(true); const all = boxes('#bar button, #bar input, details > div')"
            ".map(box => [box.left, box.right, box.top, box.bottom]); open(false);"
            "const middles = boxes('#keys-row > div').map(box => Math.round(box.top + box.bottom));"
            "return [all, new Set(middles).size]"
        )
    left, right, top, bottom = np.transpose(boxes)
    assert left.min() >= 0 and right.max() <= size[0]
    assert top.min() >= 0 and bottom.max() <= size[1]
    assert rows == (1 if size[0] > 1020 else 2)


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("size", [(640, 700), (390, 760)])
def test_axe_finds_nothing_serious(viewer, need, theme, size):
    need(AXE.is_file(), "web/node_modules/axe-core (npm ci)")
    with sized(viewer, *size):
        viewer.execute_script("document.documentElement.dataset.theme = arguments[0]", theme)
        viewer.execute_script("document.getElementById('downloads').open = true")
        viewer.execute_script(AXE.read_text(encoding="utf-8"))
        result = viewer.execute_async_script("axe.run().then(arguments[0])")
        viewer.execute_script("document.getElementById('downloads').open = false")
    told = [(each["id"], [n["html"][:80] for n in each["nodes"]]) for each in result["violations"]]
    assert result["passes"] and not told


def test_controls_are_dark_where_the_ground_is(viewer):
    """Whatever the browser prefers."""
    take = json.loads(viewer.execute_script("return document.getElementById('take').textContent"))
    assert max(take["stage"]["ground"][1]) < 100
    viewer.refresh()
    wait_for_viewer(viewer)
    assert viewer.execute_script("return document.documentElement.dataset.theme") == "dark"


def test_the_theme_is_chosen_by_hand(viewer):
    scheme = "getComputedStyle(document.documentElement).colorScheme"
    before = state(viewer, scheme)
    viewer.find_element(By.ID, "theme").click()
    assert {before, state(viewer, scheme)} == {"dark", "light"}


BACK = "getComputedStyle(document.getElementById('stage')).backgroundImage"


def test_the_stage_is_light_beside_light_controls(viewer):
    theme = "document.documentElement.dataset.theme = arguments[0];"
    middles = {}
    for name in ("light", "dark"):
        told = viewer.execute_script(f"{theme} return {BACK}", name)
        middles[name] = [
            float(each) for each in re.findall(r"[\d.]+", told.partition("rgb(")[2])[:3]
        ]
    assert min(middles["light"]) > 200 > 150 > max(middles["dark"])


def test_a_chosen_light_keeps_its_ground(motion):
    stages = {light: viewer_stage(motion.head, light) for light in ("studio", "dramatic", "day")}
    assert min(stages["studio"]["light_ground"][0]) > max(stages["studio"]["ground"][0])
    assert stages["dramatic"]["light_ground"] is None and stages["day"]["light_ground"] is None


# What is told of a button, and the box that tells it; nothing while it is hidden.
HINT = """(() => {
const hint = document.getElementById("hint"), { left, right, top } = hint.getBoundingClientRect();
if (!hint.classList.contains("shown")) return null;
return [hint.textContent, left >= 0 && right <= innerWidth && top >= 0];
})()"""


@pytest.mark.parametrize("width", [1280, 390])
def test_buttons_without_words_tell_what_they_do(viewer, width):
    with sized(viewer, width, 800):
        for name, told in (("loop", "LoopL"), ("reset", "Back to start, front view")):
            button = viewer.find_element(By.ID, name)
            ActionChains(viewer).move_to_element(button).perform()
            assert state(viewer, HINT) == [told, True]
        ActionChains(viewer).move_to_element(viewer.find_element(By.ID, "time")).perform()
        assert state(viewer, HINT) is None
        assert not viewer.execute_script(
            "return [...document.querySelectorAll('#bar .icon, #bar summary')]"
            ".filter((each) => !each.getAttribute('aria-label')).length"
        )


def test_the_keyboard_shows_and_hides_what_a_button_does(viewer):
    viewer.find_element(By.ID, "seek").send_keys(Keys.TAB)
    assert state(viewer, HINT) == ["PlaySpace", True]
    ActionChains(viewer).send_keys(Keys.ESCAPE).perform()
    assert state(viewer, HINT) is None
    ActionChains(viewer).send_keys(Keys.TAB).perform()
    assert state(viewer, HINT)[0] == "Speed"
    viewer.find_element(By.TAG_NAME, "canvas").click()
    assert state(viewer, HINT) is None


def test_nothing_is_drawn_while_nothing_changes(viewer):
    """A page that is left open costs no battery."""

    def at_rest():
        """A coarse picture, if there was one, is drawn sharply before that."""
        frames = "return elocute.renderer.info.render.frame"
        before = viewer.execute_script(frames)
        time.sleep(0.5)
        return viewer.execute_script(frames) == before

    assert eventually(at_rest)


def test_a_light_is_carried_into_the_page(viewer, motion, tmp_path):
    write_html(motion, tmp_path / "day.html", options=HtmlOptions(light="day"))
    text = (tmp_path / "day.html").read_text(encoding="utf-8")
    begin = text.index('<script id="take"')
    take = json.loads(text[text.index(">", begin) + 1 : text.index("</script>", begin)])
    red, _, blue = take["stage"]["ground"][1]
    assert blue > red + 50
