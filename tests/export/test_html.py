"""The viewer page in a real browser, from file://, without a network."""

import json
import re

import numpy as np
import pytest

from elocute.animation import animate
from elocute.export.html import ASSETS, write_html
from tests.support.browser import (
    eventually,
    headless_browser,
    open_viewer,
    wait_for_viewer,
)


@pytest.fixture(scope="module")
def page(speech_wav, tmp_path_factory):
    """A page whose name tries to break out of it."""
    path = tmp_path_factory.mktemp("html") / "a <b> & '</title>.html".replace("/", "")
    take = animate(speech_wav, fps=30)
    take.write(path)
    return path, take.motion


@pytest.fixture(scope="module")
def browser(need, tmp_path_factory):
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "700,700") as driver:
        yield driver


@pytest.fixture(scope="module")
def shown(browser, page):
    open_viewer(browser, page[0])
    return browser


pytestmark = pytest.mark.browser


def influences(browser):
    """Morph weights by name, as drawn."""
    return browser.execute_script(
        "elocute.show(); const m = elocute.meshes[0]; return Object.fromEntries("
        "Object.entries(m.morphTargetDictionary).map(([n, i]) => [n, m.morphTargetInfluences[i]]))"
    )


def test_it_loads_without_errors_and_asks_nobody(shown):
    errors = [entry for entry in shown.get_log("browser") if entry["level"] == "SEVERE"]
    assert not errors
    asked = []
    for entry in shown.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            asked.append(message["params"]["request"]["url"])
    assert any(url.startswith("file:") for url in asked)
    assert [url for url in asked if url.startswith(("http", "ws"))] == []


def test_the_name_is_shown_and_not_obeyed(shown, page):
    assert shown.title == page[0].stem
    assert shown.execute_script("return document.querySelectorAll('b').length") == 0


def test_a_head_is_drawn(shown):
    pixels = shown.execute_script(
        "elocute.show(); const c = document.querySelector('canvas'), s = document.createElement("
        "'canvas'); s.width = s.height = 64; const g = s.getContext('2d');"
        "g.drawImage(c, 0, 0, 64, 64); return Array.from(g.getImageData(0, 0, 64, 64).data)"
    )
    picture = np.array(pixels).reshape(64, 64, 4)
    assert picture[30, 32, 3] == 255 and picture[2, 2, 3] == 0
    assert picture[10:50, 22:42, :3].std() > 15


@pytest.mark.parametrize("at_s", [0.0, 1.5, 4.2])
def test_the_face_follows_the_clock_of_the_sound(shown, page, at_s):
    motion = page[1]
    shown.execute_script("elocute.sound.pause(); elocute.jump(arguments[0])", at_s)
    frame = round(at_s * motion.fps)

    def as_in_the_motion():
        drawn = influences(shown)
        for name in ("jawOpen", "mouthClose", "mouthPucker"):
            near = motion.weights[max(0, frame - 1) : frame + 2, motion.names.index(name)]
            if not near.min() - 1e-3 <= drawn[name] <= near.max() + 1e-3:
                return False
        return True

    assert eventually(as_in_the_motion), influences(shown)


def test_shapes_are_added_up_as_in_the_motion(shown, page):
    """The skin's corners before the joints turn them."""
    motion = page[1].dressed()
    head, frame = motion.head, round(4.2 * motion.fps)
    shown.execute_script("elocute.sound.pause(); elocute.jump(arguments[0])", frame / motion.fps)
    drawn = shown.execute_script(
        "elocute.show(); return Array.from(elocute.meshes[0].geometry.attributes.position.array)"
    )
    skin = head.triangle_material == 0
    corners = head.triangles[skin].ravel() * len(head.uv) + head.uv_triangles[skin].ravel()
    moved = head.template + np.tensordot(motion.weights[frame], head.expression_basis, 1)
    wanted = moved[np.unique(corners) // len(head.uv)]
    # The clock of a sound counts in microseconds.
    assert np.abs(np.reshape(drawn, (-1, 3)) - wanted).max() < 2e-6


def test_play_moves_time_and_face_together(shown, page):
    motion = page[1]
    shown.execute_script("elocute.jump(0.5); document.getElementById('play').click()")
    assert eventually(lambda: shown.execute_script("return elocute.sound.currentTime") > 0.8)
    at_s, jaw = shown.execute_script(
        "elocute.sound.pause(); elocute.show(); const m = elocute.meshes[0];"
        "const jaw = m.morphTargetInfluences[m.morphTargetDictionary.jawOpen];"
        "return [elocute.sound.currentTime, jaw]"
    )
    frame = at_s * motion.fps
    column = motion.weights[int(max(frame - 1, 0)) : int(frame) + 3, motion.names.index("jawOpen")]
    assert column.min() - 1e-3 <= jaw <= column.max() + 1e-3


def test_the_page_carries_no_address(page):
    text = page[0].read_text(encoding="utf-8")
    outside = re.sub(r'<script id="(head|sound)".*?</script>', "", text, flags=re.S)
    assert not re.search(r'(src|href)\s*=\s*["\']https?:', outside)
    assert (ASSETS / "THIRD_PARTY_NOTICES.txt").is_file()


def test_the_page_carries_the_notice_of_three_js(page):
    text = page[0].read_text(encoding="utf-8")
    assert "Copyright © 2010-" in text and "The above copyright notice" in text


@pytest.mark.slow
def test_without_sound_a_clock_keeps_time(page, browser, tmp_path):
    write_html(page[1], tmp_path / "silent.html")
    open_viewer(browser, tmp_path / "silent.html")
    browser.execute_script("document.getElementById('play').click()")
    assert eventually(lambda: browser.execute_script("return elocute.sound.currentTime") > 0.3)


@pytest.mark.slow
def test_a_notebook_shows_the_viewer(speech_wav, browser, tmp_path):
    """As in a notebook: a frame in a page, whose scripts cannot reach the page."""
    take = animate(speech_wav, fps=10)
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!doctype html><body>{take._repr_html_()}</body>", encoding="utf-8")
    browser.get(notebook.as_uri())
    browser.switch_to.frame(0)
    try:
        wait_for_viewer(browser)
        assert browser.execute_script("return elocute.meshes.length") > 0
        duration = "return elocute.sound.duration"  # once the browser has read the sound's header
        assert eventually(lambda: browser.execute_script(duration))
        assert browser.execute_script(duration) == pytest.approx(10.7, abs=0.1)
        assert browser.execute_script("return origin") == "null"
    finally:
        browser.switch_to.default_content()


@pytest.mark.parametrize(
    ("words", "said"), [(("今日", "は、", "ok?"), "今日は、ok?"), (("สวัสดี", "ครับ"), "สวัสดีครับ")]
)
def test_captions_have_spaces_where_their_script_has_them(page, browser, tmp_path, words, said):
    timed = [(0.1 * k, 0.1 * k + 0.1, word) for k, word in enumerate(words)]
    write_html(page[1], tmp_path / "words.html", words=timed)
    open_viewer(browser, tmp_path / "words.html")
    browser.execute_script("elocute.jump(0.1); elocute.show()")
    assert browser.find_element("id", "captions").text == said


def test_known_words_are_captions(page, browser, tmp_path):
    """A word is shown as it is, and marked while it is said."""
    words = [(0.1, 0.5, "one"), (0.5, 0.9, "</script><b>")]
    write_html(page[1], tmp_path / "words.html", words=words)
    open_viewer(browser, tmp_path / "words.html")
    room = "const c = document.getElementById('captions');"
    at = f"elocute.jump(arguments[0]); elocute.show(); {room}"
    told = f"{at} return [c.innerText.trim(), c.querySelector('.said')?.innerText ?? '']"
    assert browser.execute_script(told, 0.3) == ["one </script><b>", "one"]
    assert browser.execute_script(told, 0.7) == ["one </script><b>", "</script><b>"]
    assert browser.execute_script(told, 3.0) == ["", ""]
