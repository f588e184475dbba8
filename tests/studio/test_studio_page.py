"""The studio's page in a real browser, of a real `elocute studio`: what an animator does in it."""

from __future__ import annotations

import gzip
import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

import elocute
from elocute.audio.waveform import Waveform
from elocute.export.html import page_asset
from elocute.export.soundtrack import write_wav
from elocute.motion.edits.closures import sealed_frames
from elocute.motion.motion import Motion
from elocute.studio.project import open_project
from tests.support.browser import eventually, headless_browser
from tests.support.commands import SAME_ELOCUTE, python, run_here
from tests.support.gltf_files import arkit, glb, record

pytestmark = pytest.mark.browser
AXE = Path(__file__).parents[2] / "web/node_modules/axe-core/axe.min.js"
SHUT_MM, OPEN_MM = 0.35, 2.0
RATE = 16000


@pytest.fixture(scope="module")
def sounds(speech_wav: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the first words of the example, and a file that is no sound."""
    folder = tmp_path_factory.mktemp("sounds")
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: int(2.6 * RATE)]
    write_wav(Waveform(samples, RATE), folder / "line.wav")
    (folder / "broken.wav").write_text("This is no sound.")
    (folder / "hero.glb").write_bytes(glb(arkit()))
    (folder / "kopf.glb").write_bytes(glb(record(("Kopf", ["Mund_auf", "Lid_zu", "Ohr"]))))
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("takes")


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    words = python("-m", "elocute", "studio", folder, "--no-open", "--port", "0")
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=SAME_ELOCUTE) as server:
        assert server.stdout is not None
        yield re.findall(r"http://\S+", server.stdout.readline())[0]
        server.terminate()


class Animator:
    """Someone before the page."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def run(self, code: str, *given: Any) -> Any:
        return self.driver.execute_script(code, *given)

    def sees(self, condition: str) -> None:
        """Wait until something is so in the page."""
        if not eventually(lambda: self.run(f"return Boolean({condition})")):
            trouble = self.run("return elocute.studio.trouble.value")
            raise AssertionError(f"never {condition}: {trouble}; {self.driver.get_log('browser')}")

    def find(self, selector: str) -> Any:
        return self.driver.find_element("css selector", selector)

    def press(self, *keys: str) -> None:
        self.driver.switch_to.active_element.send_keys(*keys)

    def with_control(self, *keys: str) -> None:
        held = ActionChains(self.driver).key_down(Keys.CONTROL)
        held.send_keys(*keys).key_up(Keys.CONTROL).perform()

    def give(self, path: Path) -> None:
        self.find("input[type=file]").send_keys(str(path))

    def wait_for_take(self) -> None:
        self.sees("elocute.player.take && !elocute.studio.computing.value")
        self.sees("elocute.player.take === elocute.studio.shown.value")

    def project(self) -> dict[str, Any]:
        return self.run("return elocute.studio.saved.value")

    def contacts(self) -> list[list[float]]:
        return self.run("return elocute.studio.take.value.contacts")

    def phones(self) -> list[list[Any]]:
        return self.run("return elocute.studio.phones.value")

    def gap_mm(self, time_s: float) -> float:
        """How far the lips are apart in the middle, as drawn; pressed together, below zero."""
        return 1000 * self.run(
            "const { player } = elocute; player.sound.pause(); player.jump(arguments[0]);"
            "player.show(); const { mesh, stage } = player.stage.mouth;"
            "const { position } = mesh.geometry.attributes, half = stage.upper.length >> 1;"
            "return position.getY(stage.upper[half]) - position.getY(stage.lower[half]);",
            time_s,
        )

    def faults(self) -> list[str]:
        """What axe finds that is serious."""
        self.run(AXE.read_text(encoding="utf-8"))
        found = self.driver.execute_async_script(
            "axe.run(document).then(({ violations }) => arguments[0](violations))"
        )
        return [
            f"{each['id']}: {each['nodes'][0]['html']}"
            for each in found
            if each["impact"] in ("serious", "critical")
        ]


@pytest.fixture(scope="module")
def animator(need, address, sounds, tmp_path_factory) -> Iterator[Animator]:
    flags = (
        "use-fake-ui-for-media-stream",
        "use-fake-device-for-media-stream",
        f"use-file-for-fake-audio-capture={sounds / 'line.wav'}",
    )
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "1000,760", flags) as driver:
        driver.set_script_timeout(60)
        driver.get(address)
        person = Animator(driver)
        person.sees("document.body.classList.contains('ready')")
        yield person


@pytest.fixture
def line(animator: Animator, sounds: Path, folder: Path) -> Animator:
    """The page with the take of `line`, without edits."""
    if not (folder / "line.elocute.json").exists():
        animator.give(sounds / "line.wav")
    elif animator.run("return elocute.studio.name.value") != "line":
        animator.run("elocute.studio.open('line')")
    animator.sees("elocute.studio.name.value === 'line'")
    animator.wait_for_take()
    animator.run("while (elocute.studio.canUndo.value) elocute.studio.undo()")
    animator.wait_for_take()
    return animator


def played(folder: Path) -> Motion:
    """The take of `line` as Python makes it."""
    return open_project(folder / "line.elocute.json").animate().motion


def widest_s(motion: Motion) -> float:
    """When the jaw is opened widest."""
    return int(motion.weights[:, motion.names.index("jawOpen")].argmax()) / motion.fps


def test_what_is_dropped_speaks_with_lips_shut_and_open_where_they_must_be(line, folder):
    assert [each for each in line.driver.get_log("browser") if each["level"] == "SEVERE"] == []
    made = played(folder)
    shown = line.run("return Array.from(elocute.player.take.weights)")
    np.testing.assert_allclose(np.reshape(shown, made.weights.shape), made.weights, atol=1e-6)
    start, end = next(each for each in line.contacts() if each[0] > 0.5)
    phone = next(each for each in line.phones() if each[2] in "PBM")
    assert start < phone[1] and phone[0] < end
    assert line.gap_mm((start + end) / 2) < SHUT_MM
    assert line.gap_mm(widest_s(made)) > OPEN_MM


def test_playing_moves_the_head_with_the_sound(line):
    line.gap_mm(0.4)
    line.find("canvas").click()
    line.press(Keys.ARROW_RIGHT)
    assert line.run("return elocute.now.value") == pytest.approx(0.4 + 1 / 60, abs=1e-5)
    line.find("#play").click()
    line.sees("elocute.now.value > 0.8")
    shown = line.run(
        "const { player } = elocute, { stage: { head }, take } = player; player.sound.pause();"
        "player.show(); return [Array.from(head.weights), player.posed * take.fps,"
        "Array.from(take.weights), take.shapes.length]"
    )
    weights, frame, curves, width = shown
    rows = np.reshape(curves, (-1, width))
    at = min(frame, len(rows) - 1)
    here, after, share = rows[int(at)], rows[int(np.ceil(at))], at % 1
    between = (1 - share) * here + share * after
    np.testing.assert_allclose(weights, between, atol=1e-5)


def drag(person: Animator, block: Any, seconds: float) -> None:
    """Take a block in its middle along the timeline."""
    lane = person.find(".row.phones .lane").rect["width"]
    pixels = round(seconds * lane / person.run("return elocute.studio.duration.value"))
    ActionChains(person.driver).click_and_hold(block).move_by_offset(pixels, 0).release().perform()


def test_a_phone_that_is_dragged_takes_its_closure_along_in_page_and_file(line, folder, tmp_path):
    before = line.phones()
    index, (start, end, _) = next(
        (i, each) for i, each in enumerate(before) if each[2] == "M" and each[0] > 0.5
    )
    label = f"M, {start:.2f} to {end:.2f} s"
    drag(line, line.find(f'.row.phones .block[aria-label="{label}"]'), 0.12)
    line.wait_for_take()
    moved = line.phones()[index]
    assert 0.06 < moved[0] - start < 0.16 and moved[1] - moved[0] == pytest.approx(end - start)
    middle = (moved[0] + moved[1]) / 2
    assert line.gap_mm(middle) < SHUT_MM
    assert any(begin <= middle <= stop for begin, stop in line.contacts())
    run_here("render", folder / "line.elocute.json", "-o", tmp_path / "line.npz")
    motion = elocute.load_motion(tmp_path / "line.npz")
    sealed = sealed_frames(motion)
    assert sealed[round(middle * motion.fps)] and not sealed[round((start - 0.04) * motion.fps)]
    # Undone, the take and its file are as they were.
    line.with_control("z")
    line.wait_for_take()
    assert line.phones() == before
    saved = json.loads((folder / "line.elocute.json").read_text(encoding="utf-8"))
    assert saved["phones"] is None


def test_by_keyboard_alone(line, folder):
    count = len(line.phones())
    line.run("document.querySelector('.row.phones .block[tabindex=\"0\"]').focus()")
    line.press(Keys.ARROW_DOWN)
    line.press("s")
    assert len(line.phones()) == count + 1
    line.sees("document.activeElement.matches('.block[aria-pressed=true]')")
    line.press("j")
    assert len(line.phones()) == count
    line.sees("document.activeElement.matches('.block[aria-pressed=true]')")
    line.press(".")
    line.sees("document.activeElement.matches('.block[aria-pressed=true]')")
    line.press(Keys.ENTER)  # to the field with its symbol
    line.press("P")
    line.wait_for_take()
    assert line.phones()[1] == line.run("return elocute.studio.take.value.phones[1]")
    assert line.phones()[1][2] == "P"
    line.gap_mm(2.0)
    line.find("canvas").click()
    line.press("c")
    line.press("b")
    line.press("k")
    line.wait_for_take()
    edits = {each["edit"]: each for each in line.project()["edits"]}
    assert edits["closed"]["from"] == pytest.approx(2.0, abs=0.02)
    assert edits["blinks"]["add"] and edits["curve"]["curve"] == "jawOpen"
    assert line.gap_mm(2.1) < SHUT_MM
    assert (
        json.loads((folder / "line.elocute.json").read_text())["edits"] == line.project()["edits"]
    )
    assert line.faults() == []


def test_lips_are_opened_against_a_closure(line):
    start, end = next(each for each in line.contacts() if each[0] > 0.5)
    line.gap_mm((start + end) / 2)
    line.find('[aria-label="Lips shut here"]').click()
    line.find(".chosen button").click()  # open instead
    line.wait_for_take()
    assert line.find(".block.lips").text == "open"
    assert line.gap_mm((start + end) / 2 + 0.1) > OPEN_MM


def test_two_takes_are_compared_at_the_same_time(line, folder):
    line.gap_mm(widest_s(played(folder)))
    line.find("canvas").click()
    line.press("x")  # hold
    line.run("elocute.studio.change({ ...elocute.studio.saved.value, settings: { strength: 0 } })")
    line.wait_for_take()
    jaw = "const { stage } = elocute.player, [mesh] = stage.meshes; elocute.player.show();"
    jaw += (
        "return [mesh.morphTargetInfluences[mesh.morphTargetDictionary.jawOpen], elocute.now.value]"
    )
    line.sees("elocute.studio.showing.value === 'B'")
    calm, at = line.run(jaw)
    line.press("x")
    line.sees("elocute.studio.showing.value === 'A'")
    line.sees("elocute.player.take === elocute.studio.held.value.take")
    wide, same = line.run(jaw)
    assert wide > calm + 0.02 and same == at
    line.press("x")
    line.run("elocute.studio.held.value = null")


def test_what_somebody_else_saves_is_shown_and_undone(line, folder):
    """As from another tab."""
    status = line.driver.execute_async_script(
        "const [done] = arguments, at = '/api/projects/line', type = 'application/json';"
        "fetch(at).then(async (read) => {"
        " const edits = [{ edit: 'closed', from: 1, to: 1.2 }];"
        " const body = JSON.stringify({ ...await read.json(), edits });"
        " const headers = { 'content-type': type, 'if-match': read.headers.get('etag') };"
        " done((await fetch(at, { method: 'PUT', body, headers })).status); });"
    )
    assert status == 200
    line.sees("elocute.studio.saved.value.edits.length === 1")
    line.wait_for_take()
    assert line.gap_mm(1.1) < SHUT_MM
    line.with_control("z")
    line.wait_for_take()
    saved = json.loads((folder / "line.elocute.json").read_text(encoding="utf-8"))
    assert saved["edits"] == []


def test_an_own_character_is_understood(line, sounds):
    line.find("#tab-character").click()
    line.find(".panel input[type=file]").send_keys(str(sounds / "hero.glb"))
    line.sees("elocute.studio.saved.value.character === 'hero.glb'")
    line.sees("document.querySelector('.panel details')")
    told = line.find(".panel").get_attribute("textContent")
    assert "jawOpen" in told and "Mapped" in told
    line.wait_for_take()
    line.sees("elocute.player.take.character === 'hero.glb'")


def test_shapes_whose_names_say_nothing_are_explained(line, sounds, folder):
    line.find("#tab-character").click()
    line.find(".panel input[type=file]").send_keys(str(sounds / "kopf.glb"))
    line.sees("document.querySelectorAll('.panel details select').length === 3")
    line.sees("elocute.studio.trouble.value?.includes('kopf.names.json')")
    assert line.faults() == []
    for shape, does in (("Mund_auf", "jawOpen"), ("Lid_zu", "eyeBlinkLeft"), ("Ohr", "left alone")):
        field = line.run(
            "return [...document.querySelectorAll('.panel details .field')]"
            ".find((each) => each.innerText.startsWith(arguments[0])).querySelector('select')",
            shape,
        )
        Select(field).select_by_visible_text(does)
        line.sees(f"document.querySelector('.panel').innerText.includes('{shape}')")
        line.sees("!elocute.studio.computing.value")
    line.wait_for_take()
    line.sees("elocute.player.take.character === 'kopf.glb'")
    line.sees("elocute.studio.trouble.value === null")
    names = json.loads((folder / "kopf.names.json").read_text(encoding="utf-8"))
    assert names == {"Mund_auf": "jawOpen", "Lid_zu": "eyeBlinkLeft", "Ohr": None}
    line.with_control("z")
    line.sees("elocute.studio.saved.value.character !== 'kopf.glb'")


def test_what_cannot_be_used_is_said_in_one_line(line, sounds):
    line.find('[aria-label="All projects"]').click()
    line.sees("document.querySelector('.drop')")
    assert line.faults() == []
    line.give(sounds / "broken.wav")
    line.sees("document.querySelector('[role=alert]')")
    told = line.find("[role=alert] span").text
    assert told.startswith("broken.wav") and "\n" not in told
    line.find('[role=alert] [aria-label="Close"]').click()
    line.find(".projects button").click()
    line.wait_for_take()


def test_the_microphone_makes_a_take(line, folder):
    line.find('[aria-label="All projects"]').click()
    line.sees("document.querySelector('#record')")
    line.find("#record").click()
    line.sees("document.querySelector('#record').textContent.includes('0:01')")
    line.find("#record").click()
    line.sees("elocute.studio.name.value?.startsWith('recording')")
    line.wait_for_take()
    assert line.run("return elocute.studio.duration.value") > 0.9
    (made,) = folder.glob("recording*.wav")
    assert np.abs(elocute.read_audio(made).samples).max() > 0.01
    line.find('[aria-label="All projects"]').click()


def test_a_telephone_plays(line):
    line.driver.set_window_size(390, 844)
    line.sees("innerWidth < 500")
    assert line.find("#play").is_displayed()
    assert not line.find(".row.phones").is_displayed()
    assert line.run("return document.documentElement.scrollWidth <= innerWidth")
    assert line.faults() == []
    line.driver.set_window_size(1000, 760)


def test_the_page_is_small():
    """With three.js; heads come by themselves."""
    packed = sum(
        len(gzip.compress(page_asset(f"studio.{kind}").encode())) for kind in ("js", "html")
    )
    assert packed < 400_000
