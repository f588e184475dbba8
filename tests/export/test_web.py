"""Files made small for the net, unpacked and moved by three.js in Chromium."""

from __future__ import annotations

import base64
import sys

import numpy as np
import pytest

from elocute.animation import animate
from elocute.errors import MachineError, OutputError
from elocute.export.gltf import glb_bytes
from elocute.export.html import write_html
from elocute.export.options import GlbOptions, HtmlOptions
from elocute.export.registry import write
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_document import gltf_document
from elocute.motion.motion import Motion
from tests.export.test_fitted_profiles import PAGE
from tests.export.test_gltf import LEFT_TO_THE_VIEWER
from tests.support.browser import headless_browser, open_viewer
from tests.support.gltf_files import arkit, glb
from tests.support.three_js import node_program, open_program, validator_issues

pytest.importorskip("meshopt", reason="needs the extra `web`")

DECODES = PAGE.replace(
    "import { GLTFLoader }",
    'import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";\n'
    "import { GLTFLoader }",
).replace("new GLTFLoader()", "new GLTFLoader().setMeshoptDecoder(MeshoptDecoder)")
WHOLE, SMALL = GlbOptions(profile="elocute"), GlbOptions(profile="elocute", web=True)
MOST_BYTES = 2_500_000
CLOSE_M = 5e-5


@pytest.fixture(scope="module")
def spoken(motion) -> Motion:
    """Three seconds of the take, with lips that meet."""
    return Motion(motion.head, motion.weights[60:150], motion.fps)


@pytest.fixture(scope="module")
def small(spoken) -> bytes:
    return glb_bytes(spoken, options=SMALL)


def test_it_is_a_third_of_the_size(spoken, small):
    assert len(small) < len(glb_bytes(spoken, options=WHOLE)) / 3


@pytest.mark.system
def test_khronos_validator_finds_no_error(dressed, small, tmp_path, need):
    few = Motion(dressed.head, dressed.weights[:5], dressed.fps)
    for name, data in {"bare": small, "dressed": glb_bytes(few, options=SMALL)}.items():
        path = tmp_path / f"{name}.glb"
        path.write_bytes(data)
        issues = validator_issues(node_program(need), path)
        assert [issue for issue in issues if issue[0] == 0] == [], name
        assert {issue[1] for issue in issues if issue[0] == 1} <= LEFT_TO_THE_VIEWER, name


@pytest.fixture(scope="module")
def browser(need, tmp_path_factory):
    with open_program(need, DECODES, tmp_path_factory.mktemp("page")) as driver:
        yield driver


@pytest.mark.browser
@pytest.mark.system
def test_three_js_moves_vertices_as_the_motion_does(small, spoken, browser):
    text = base64.b64encode(small).decode()
    done = "window.open_file(arguments[0]).then(arguments[1], (e) => arguments[1](String(e)))"
    places = browser.execute_async_script(done, text)
    assert tuple(sorted(places, key=places.get)) == spoken.names
    for frame in (0, 41, 80):
        points = browser.execute_script("return at(arguments[0], 37)", frame / spoken.fps)
        rest, found = np.split(np.array(points), 2, axis=1)
        apart = np.stack([np.abs(spoken.head.template - place).max(axis=1) for place in rest])
        assert apart.min(axis=1).max() < 2e-5
        wanted = spoken.vertices(frame, frame + 1)[0][apart.argmin(axis=1)]
        assert np.abs(found - wanted).max() < CLOSE_M


def test_our_own_reader_unpacks_it(small, spoken):
    document = gltf_document(small, "small")
    arrays = GltfArrays(document)
    places = document.records("meshes")[0]["primitives"][0]["attributes"]["POSITION"]
    record = document.records("accessors")[places]
    values = arrays.values(places)
    assert values.min(axis=0).tolist() == record["min"]
    assert values.max(axis=0).tolist() == record["max"]
    head = spoken.head
    skin = head.template[np.unique(head.triangles[head.triangle_material == 0])]
    assert np.abs(values.min(axis=0) - skin.min(axis=0)).max() < 2e-5


def test_weights_of_joints_still_add_up(small):
    document = gltf_document(small, "small")
    arrays = GltfArrays(document)
    for primitive in document.records("meshes")[0]["primitives"]:
        weights = arrays.values(primitive["attributes"]["WEIGHTS_0"])
        assert weights.sum(axis=1) == pytest.approx(1, abs=1e-9)


@pytest.mark.browser
def test_a_small_page_shows_the_same(motion, speech_wav, need, tmp_path):
    for name, web in (("whole", False), ("small", True)):
        options = HtmlOptions(web=web, title="take")
        write_html(motion, tmp_path / f"{name}.html", sound=speech_wav, options=options)
    small = (tmp_path / "small.html").read_text(encoding="utf-8")
    assert "three.js" in small and "meshoptimizer" in small  # the notices
    seen = {}
    with headless_browser(need, tmp_path / "profile", "500,500") as driver:
        for name in ("whole", "small"):
            open_viewer(driver, tmp_path / f"{name}.html")
            errors = [each for each in driver.get_log("browser") if each["level"] == "SEVERE"]
            assert errors == []
            seen[name] = np.array(
                driver.execute_script(
                    "elocute.jump(5.5); elocute.show(); const c = document.createElement('canvas');"
                    "c.width = c.height = 64; const p = c.getContext('2d');"
                    "p.drawImage(document.querySelector('canvas'), 0, 0, 64, 64);"
                    "return [...p.getImageData(0, 0, 64, 64).data]"
                )
            )
    assert seen["whole"].std() > 20
    assert np.abs(seen["whole"] - seen["small"]).mean() < 2  # of 255


@pytest.mark.slow
def test_the_default_look_s_files_are_small(speech_wav, tmp_path):
    take = animate(speech_wav)
    for name in ("talk.glb", "talk.html"):
        take.write(tmp_path / name, web=True)
        assert (tmp_path / name).stat().st_size <= MOST_BYTES, name


def test_what_is_not_made_small_is_told(motion, tmp_path, speech_wav):
    hero = tmp_path / "hero.glb"
    hero.write_bytes(glb(arkit()))
    spoken = animate(speech_wav, fps=5, head=hero).motion
    with pytest.raises(OutputError, match=r"`web`: a head with shapes of its own \(hero\.glb\)"):
        write(spoken, tmp_path / "a.glb", web=True)
    with pytest.raises(OutputError, match="`web`: `animation_only` too"):
        GlbOptions(web=True, animation_only=True)


def test_without_its_package_it_says_what_to_install(motion, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshopt", None)
    with pytest.raises(MachineError, match=r"pip install \"elocute\[web\]\""):
        write(motion, tmp_path / "a.glb", web=True)
    assert list(tmp_path.iterdir()) == []
