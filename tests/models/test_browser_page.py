"""The page of examples/browser: a head that says what it hears, and a browser alone."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import elocute
from tests.support.browser import eventually, headless_browser, wait_for_viewer
from tests.support.browser_speech import served
from tests.support.three_js import MODULES, node_program

pytestmark = pytest.mark.browser
MAKE = Path(__file__).parents[2] / "examples" / "browser" / "make.py"
HEARD = "return [elocute.page.take.whole, elocute.page.take.frames.length]"
# A microphone that hears a tone.
MICROPHONE = """
const { context } = elocute.page;
navigator.mediaDevices.getUserMedia = async () => {
  const there = context.createMediaStreamDestination(), source = context.createOscillator();
  source.connect(there);
  source.start();
  return there.stream;
};
document.getElementById("microphone").click();
"""


@pytest.fixture(scope="module")
def page(
    need: Callable[[object, str], None], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Any, str]]:
    node_program(need)
    need((MODULES / "onnxruntime-web").is_dir(), "onnxruntime-web in web/node_modules (npm ci)")
    folder = tmp_path_factory.mktemp("page")
    subprocess.run([sys.executable, MAKE, folder / "out"], check=True)
    profile = folder / "profile"
    with served(folder / "out") as address, headless_browser(need, profile, "300,300") as driver:
        driver.get(address)
        wait_for_viewer(driver)
        state = "return document.getElementById('state').textContent"
        assert eventually(lambda: driver.execute_script(state) == "Drop a sound, or speak")
        yield driver, address


def test_a_sound_moves_the_head(page: tuple[Any, str], speech_wav: Path) -> None:
    driver, _ = page
    driver.find_element("id", "file").send_keys(str(speech_wav))
    wanted = elocute.animate(speech_wav, life=0).curves
    assert eventually(lambda: driver.execute_script(HEARD) == [True, len(wanted.values)])
    assert driver.execute_script("return elocute.page.take.time()") > 0
    jaws = wanted.values[:, wanted.names.index("jawOpen")]
    widest = int(jaws.argmax())
    driver.execute_script(f"elocute.page.take.time = () => {widest / wanted.fps}")
    jaw = "return elocute.influences[elocute.places.jawOpen]"
    near = pytest.approx(jaws[widest], abs=0.05)
    assert eventually(lambda: driver.execute_script(jaw) == near)


def test_the_microphone_is_heard(page: tuple[Any, str]) -> None:
    driver, _ = page
    driver.execute_script(MICROPHONE)
    assert eventually(lambda: driver.execute_script(HEARD) > [False, 30])
    driver.find_element("id", "microphone").click()
    assert eventually(lambda: driver.execute_script(HEARD)[0])


def test_a_file_that_is_no_sound_is_told(page: tuple[Any, str], tmp_path: Path) -> None:
    driver, _ = page
    (tmp_path / "note.txt").write_text("no sound")
    driver.find_element("id", "file").send_keys(str(tmp_path / "note.txt"))
    state = "return document.getElementById('state').textContent"
    assert eventually(lambda: "note.txt" in driver.execute_script(state))


def test_nothing_is_asked_of_others(page: tuple[Any, str]) -> None:
    driver, address = page
    messages = [json.loads(each["message"])["message"] for each in driver.get_log("performance")]
    asked = [
        message["params"]["request"]["url"]
        for message in messages
        if message["method"] == "Network.requestWillBeSent"
    ]
    assert [
        url for url in asked if not url.startswith((address, "blob:", "data:", "chrome:"))
    ] == []
