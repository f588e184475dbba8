"""The live page and the JavaScript client in a real browser: the face is that of the stream."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("websockets")

import elocute
from elocute.live.live_frame import LiveFrame
from elocute.live.targets import Access
from elocute.live.ws_server import LiveServer
from tests.support.browser import eventually, headless_browser, wait_for_viewer
from tests.support.three_js import MODULES, WEB, bundled, node_program, open_program

RATE = 16000
pytestmark = pytest.mark.browser


def open_stream(rate: int) -> Any:
    return elocute.stream(rate, lookahead=0.3)


@pytest.fixture(scope="module")
def server() -> Iterator[LiveServer]:
    made = LiveServer(("127.0.0.1", 0), Access(origins=("null",)))  # a page of file:
    made.hear(open_stream)
    yield made
    made.close()


@pytest.fixture(scope="module")
def sound(speech_wav: Path) -> np.ndarray:
    """Three seconds of speech, in steps of 16 bits."""
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: 3 * RATE]
    return np.round(samples * 32767).astype(np.float32)


@pytest.fixture(scope="module")
def wanted(sound: np.ndarray) -> list[LiveFrame]:
    frames = open_stream(RATE).push(sound / 32768)
    return [LiveFrame(number, 60.0, frame) for number, frame in enumerate(frames)]


def between(wanted: list[LiveFrame], time_s: float, value: Callable[[LiveFrame], Any]) -> Any:
    """What is seen at a time."""
    at = int(time_s * 60)
    here, after = value(wanted[at]), value(wanted[at + 1])
    return here + (time_s * 60 - at) * (after - here)


SPEAK = """
const [samples, done] = arguments, face = elocute.FACE, shown = [];
face.context.resume().then(() => face.speak(Int16Array.from(samples), 16000));
face.addEventListener("started", ({ detail: { time_s } }) => {
  const look = () => {
    const time = face.update() - time_s;
    elocute.apply?.();
    if (time > 0.3 && time < 2.6 && !face.fading) shown.push([time, SEEN]);
    if (time > 2.6) done(shown); else setTimeout(look, 50);
  };
  look();
}, { once: true });
"""


def spoken(driver: Any, sound: np.ndarray, *seen: str, face: str = "face") -> list[list[Any]]:
    """Let a page speak; the time and what was seen, again and again."""
    code = SPEAK.replace("FACE", face).replace("SEEN", ", ".join(seen))
    shown = driver.execute_async_script(code, sound.tolist())
    assert len(shown) > 5
    return shown


JAW = (
    "(({ morphTargetDictionary: d, morphTargetInfluences: i }) => i[d.jawOpen])(elocute.meshes[0])"
)
PRESSED = JAW.replace("jawOpen", "mouthClose")
NOD = "elocute.joints.head.quaternion.x"


@pytest.fixture(scope="module")
def page(need, server: LiveServer, tmp_path_factory) -> Iterator[Any]:
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "500,500") as driver:
        driver.set_script_timeout(60)
        driver.get(server.address)
        wait_for_viewer(driver)
        assert eventually(lambda: driver.execute_script("return elocute.face.ready"))
        yield driver


def test_the_page_shows_what_is_said_when_it_is_heard(page, server, sound, wanted):
    shown = spoken(page, sound, JAW, PRESSED, NOD)
    assert max(jaw for _, jaw, *_ in shown) > 0.1
    for time_s, jaw, pressed, nod in shown:
        values = between(wanted, time_s, lambda frame: frame.frame.values)
        curves = dict(zip(wanted[0].frame.names, values, strict=True))
        assert jaw == pytest.approx(curves["jawOpen"], abs=0.02)
        assert pressed == pytest.approx(curves["mouthClose"], abs=0.02)
        assert nod == pytest.approx(between(wanted, time_s, lambda f: f.joint("head")[1]), abs=5e-3)
    errors = [entry for entry in page.get_log("browser") if entry["level"] == "SEVERE"]
    assert not errors
    assert page.execute_script("return document.getElementById('state').textContent") == "Live"


def test_the_page_asks_this_server_alone(page, server):
    asked = [
        message["params"]["request"]["url"]
        for message in (
            json.loads(each["message"])["message"] for each in page.get_log("performance")
        )
        if message["method"] == "Network.requestWillBeSent"
    ]
    others = [
        url for url in asked if not url.startswith((server.address, "blob:", "data:", "chrome:"))
    ]
    assert others == []


PROGRAM = """
import * as THREE from "three";
import { VRMExpression, VRMExpressionManager as Manager, VRMExpressionMorphTargetBind as Bind } from
  "@pixiv/three-vrm";
import { LiveFace } from "./live-client/index.js";

const names = (mesh, list) => {
  mesh.morphTargetDictionary = Object.fromEntries(list.map((name, at) => [name, at]));
  mesh.morphTargetInfluences = list.map(() => 0);
  return mesh;
};
const context = new AudioContext(), url = "URL";
const scene = new THREE.Group(), head = new THREE.Bone();
const mesh = names(new THREE.Mesh(), ["Wolf3D.jawOpen", "mouthClose", "eyeBlink_L", "tail"]);
scene.add(new THREE.Group().add(mesh), head);
const face = new LiveFace(url, { face: "three", context });
face.attach(scene, { head });

const body = names(new THREE.Mesh(), ["mouth_a"]);
const expressionManager = new Manager(), aa = new VRMExpression("aa");
aa.addBind(new Bind({ primitives: [body], index: 0, weight: 1 }));
expressionManager.registerExpression(aa);
const vrm = new LiveFace(url, { shapes: "vrm", face: "vrm", context });
vrm.attach({ expressionManager });
const apply = () => expressionManager.update();
window.elocute = { face, vrm, mesh, body, head, apply };
"""


@pytest.fixture(scope="module")
def avatars(need, server: LiveServer, tmp_path_factory) -> Iterator[Any]:
    code = PROGRAM.replace("URL", f"ws://127.0.0.1:{server.port}/live")
    with open_program(need, code, tmp_path_factory.mktemp("avatars")) as driver:
        driver.set_script_timeout(60)
        ready = "return window.elocute?.face.ready && elocute.vrm.ready"
        assert eventually(lambda: driver.execute_script(ready))
        yield driver


def test_a_head_of_three_js_is_moved_by_its_own_names(avatars, sound, wanted):
    """Whatever stands before a name, and however it spells its side."""
    seen = ["elocute.mesh.morphTargetInfluences.slice()", "elocute.head.quaternion.toArray()"]
    for time_s, (jaw, pressed, blink, tail), turn in spoken(avatars, sound, *seen):
        arkit = {
            name: between(wanted, time_s, lambda frame, name=name: frame.arkit[name])
            for name in ("jawOpen", "mouthClose", "eyeBlinkLeft")
        }
        assert [jaw, pressed, blink, tail] == pytest.approx([*arkit.values(), 0], abs=0.02)
        w, x, y, z = between(wanted, time_s, lambda frame: frame.joint("head"))
        assert turn == pytest.approx([x, y, z, w], abs=5e-3)


def test_a_vrm_is_moved_by_its_expressions(avatars, sound, wanted):
    seen = ["elocute.body.morphTargetInfluences[0]"]
    for time_s, weight in spoken(avatars, sound, *seen, face="vrm"):
        assert weight == pytest.approx(
            between(wanted, time_s, lambda frame: frame.vrm["aa"]), abs=0.02
        )


def test_an_interruption_is_silent_at_once_and_the_lips_close(avatars, sound):
    avatars.execute_async_script(
        "const [samples, done] = arguments, { face } = elocute; "
        "face.addEventListener('started', () => setTimeout(done, 700), { once: true }); "
        "face.speak(Int16Array.from(samples), 16000)",
        sound.tolist(),
    )
    avatars.execute_script("elocute.face.interrupt()")
    assert avatars.execute_script("return elocute.face.sources.size") == 0
    shut = "elocute.face.update(); return elocute.mesh.morphTargetInfluences[0] < 0.02"
    assert eventually(lambda: avatars.execute_script(shut))


def test_the_client_is_small(need):
    node_program(need)
    client = WEB / "live-client" / "index.js"
    command = [MODULES / ".bin" / "esbuild", "--minify", "--format=esm", client]
    assert len(subprocess.run(command, capture_output=True, check=True).stdout) < 10_000


def test_the_documented_program_is_one(need):
    """It can be bundled, and calls what the client has."""
    node_program(need)
    text = (WEB.parent / "docs/use/live.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```js\n(.*?)```", text, re.DOTALL)
    client = (WEB / "live-client/index.js").read_text(encoding="utf-8")
    types = (WEB / "live-client/index.d.ts").read_text(encoding="utf-8")
    assert "LiveFace" in bundled(program, platform="browser")
    called = set(re.findall(r"face\.(\w+)\(", program)) - {"addEventListener"}
    assert called == {"attach", "speak", "update"}
    for name in re.findall(r"^  (\w+)\(.*\): ", types, re.M):  # whatever the types promise
        assert re.search(rf"^  (async )?{name}\(", client, re.M), name
