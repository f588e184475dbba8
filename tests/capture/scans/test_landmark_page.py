"""Landmarks set by hand on a page, in a real browser: clicked, taken over, saved, opened again."""

from __future__ import annotations

import io
import json
import time

import numpy as np
import pytest
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from elocute.capture.scans.landmark_page import KEY_LANDMARKS, LANDMARK_NAMES, write_landmark_page
from elocute.errors import CaptureError, OutputError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identities
from elocute.registration.landmarks import GOOD_MIN, read_landmarks
from elocute.registration.scan import Scan
from elocute.registration.scan_file import read_scan, write_scan
from tests.support.browser import PATIENCE_S, headless_browser, open_viewer

# Where a place of the file's frame is in the window, in pixels.
SEEN = """
const place = elocute.average[0].clone().fromArray(arguments[0]);
elocute.world.updateMatrixWorld(true);
elocute.camera.updateMatrixWorld(true);
elocute.mesh.localToWorld(place).project(elocute.camera);
const box = document.querySelector("canvas").getBoundingClientRect();
return [box.left + box.width * (place.x + 1) / 2, box.top + box.height * (1 - place.y) / 2];
"""


@pytest.fixture(scope="module")
def person():
    """A face in millimetres that lies on its side, and its landmarks."""
    head = load_builtin_head()
    weights = sample_identities(head, 1, seed=5)[0]
    points = head.template + np.tensordot(weights, head.identity_basis, 1)
    points = 1000 * points @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]).T + [30.0, -400, 12]
    skin = np.isin(
        head.material, [head.material_names.index(name) for name in ("skin", "lips", "mouth")]
    )
    quads = head.quads[skin]  # a scan's eyes are closed behind its lids
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return points, triangles, points[head.landmarks]


@pytest.fixture(scope="module")
def page(person, need, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    write_scan(folder / "face.ply", person[0], person[1])
    write_landmark_page(folder / "face.html", read_scan(folder / "face.ply"))
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "1100,800") as driver:
        driver.execute_cdp_cmd(
            "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)}
        )
        driver.folder = folder
        yield driver


@pytest.fixture
def opened(page):
    page.execute_script("if (window.elocute) elocute.saved = true")  # or leaving asks
    open_viewer(page, page.folder / "face.html")
    return page


pytestmark = pytest.mark.browser


def on_screen(browser, place):
    return np.array(browser.execute_script(SEEN, np.asarray(place).tolist()))


def click(browser, place):
    x, y = on_screen(browser, place)
    chain = ActionChains(browser)
    chain.w3c_actions.pointer_action.move_to_location(round(float(x)), round(float(y))).click()
    chain.perform()


def asked(browser):
    return browser.execute_script("return elocute.current")


def saved(browser):
    path = browser.folder / "face.json"
    path.unlink(missing_ok=True)
    browser.find_element(By.ID, "save").click()
    WebDriverWait(browser, PATIENCE_S).until(lambda _: path.is_file())
    return read_landmarks(path)


def test_what_is_clicked_is_what_is_saved(opened, person):
    """The face lies on its side at first; after four landmarks the page has turned it upright."""
    truth = person[2]
    seen = []
    while opened.execute_script("return elocute.set.size") < GOOD_MIN:
        seen.append(asked(opened))
        click(opened, truth[seen[-1]])
    assert tuple(seen) == KEY_LANDMARKS[:GOOD_MIN]
    eyes = [on_screen(opened, truth[index]) for index in (36, 45)]
    assert abs(eyes[0][1] - eyes[1][1]) < 0.1 * (eyes[1][0] - eyes[0][0])
    found = saved(opened)
    assert found.enough and found.good.sum() == GOOD_MIN
    # A lid lies before its corner, and between lips there is a gap: depth may differ.
    pixels = [on_screen(opened, found.points[i]) - on_screen(opened, truth[i]) for i in seen[4:]]
    assert np.abs(pixels).max() < 1.0
    off = np.linalg.norm(found.points[seen] - truth[seen], axis=1)
    assert np.quantile(off, 0.9) < 7.0


@pytest.mark.slow
def test_the_ring_lies_where_the_next_landmark_is(opened, person):
    truth = person[2]
    for _ in range(8):
        click(opened, truth[asked(opened)])
    off = []
    while opened.execute_script("return elocute.set.size") < len(KEY_LANDMARKS):
        index = asked(opened)
        ring = opened.execute_script("return elocute.suggested.toArray()")
        off.append(np.linalg.norm(np.array(ring) - truth[index]))
        opened.find_element(By.TAG_NAME, "canvas").send_keys(Keys.ENTER)
        assert asked(opened) != index
    assert np.median(off) < 5.0
    assert max(off) < 12.0
    assert saved(opened).good.sum() == len(KEY_LANDMARKS)


@pytest.mark.slow
def test_a_landmark_is_cleared_and_a_saved_file_is_gone_on_with(opened, person):
    truth = person[2]
    for _ in range(5):
        click(opened, truth[asked(opened)])
    opened.find_element(By.CSS_SELECTOR, "#map button.set").click()
    opened.find_element(By.ID, "clear").click()
    assert opened.execute_script("return elocute.set.size") == 4
    assert not opened.find_element(By.ID, "save").is_enabled()
    path = opened.folder / "earlier.json"
    points = [
        point if index in KEY_LANDMARKS else None for index, point in enumerate(truth.tolist())
    ]
    path.write_text(json.dumps({"points": points}), encoding="utf-8")
    opened.find_element(By.ID, "file").send_keys(str(path))
    WebDriverWait(opened, PATIENCE_S).until(
        lambda _: opened.execute_script("return elocute.set.size") == len(KEY_LANDMARKS)
    )
    assert (
        np.nanmax(np.abs(saved(opened).points[list(KEY_LANDMARKS)] - truth[list(KEY_LANDMARKS)]))
        < 1e-3
    )


def test_a_file_without_landmarks_is_told(opened):
    path = opened.folder / "other.json"
    path.write_text('{"points": [1, 2]}', encoding="utf-8")
    opened.find_element(By.ID, "file").send_keys(str(path))
    told = opened.find_element(By.ID, "count")
    WebDriverWait(opened, PATIENCE_S).until(lambda _: "holds no landmarks" in told.text)


def test_nothing_is_fetched_and_nothing_is_wrong(opened):
    time.sleep(0.5)
    assert [line for line in opened.get_log("browser") if line["level"] == "SEVERE"] == []
    asked_for = [
        json.loads(line["message"])["message"]["params"].get("request", {}).get("url", "")
        for line in opened.get_log("performance")
    ]
    assert [url for url in asked_for if url.startswith("http")] == []


def test_the_mesh_is_drawn(opened):
    picture = Image.open(io.BytesIO(opened.get_screenshot_as_png())).convert("RGB")
    stage = np.asarray(picture)[100:600, 100:600].astype(int)
    assert len(np.unique(stage.reshape(-1, 3), axis=0)) > 200


def test_there_is_a_name_for_each():
    assert len(LANDMARK_NAMES) == 68 == len(set(LANDMARK_NAMES))
    assert len(set(KEY_LANDMARKS)) == len(KEY_LANDMARKS) >= GOOD_MIN


@pytest.mark.parametrize(
    ("name", "points", "error", "told"),
    [
        ("a.txt", 4, OutputError, ".html"),
        ("a.html", 1_000_001, CaptureError, "1000001 points"),
    ],
)
def test_what_a_page_cannot_hold(tmp_path, name, points, error, told):
    scan = Scan("s.ply", np.zeros((points, 3)), np.zeros((1, 3), np.int32))
    with pytest.raises(error, match=told):
        write_landmark_page(tmp_path / name, scan)
    assert not (tmp_path / name).exists()
