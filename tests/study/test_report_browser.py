"""A report in a real browser: nothing that axe finds, nothing wider than its page, no request."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib")

from elocute.study.crowd import Crowd, crowd_answers, seats_of
from elocute.study.report.report import make_report
from elocute.study.report.report_page import page_text
from tests.study.designs import design_of
from tests.support.browser import headless_browser

pytestmark = pytest.mark.browser
AXE = Path(__file__).parents[2] / "web/node_modules/axe-core/axe.min.js"


@pytest.fixture(scope="module")
def opened(need, tmp_path_factory) -> Iterator[Any]:
    """A driver that shows the report of a small rating study."""
    folder = tmp_path_factory.mktemp("report")
    design = design_of("rating")
    answers = crowd_answers(design, Crowd(people_sd=6), seats_of(design, 10), 1)
    (folder / "report.html").write_text(page_text(make_report(design, answers)), encoding="utf-8")
    with headless_browser(need, folder / "profile", "1100,900") as driver:
        driver.get((folder / "report.html").as_uri())
        yield driver


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1100, 900), (400, 800)])
def test_axe_finds_nothing(opened, need, theme, size):
    need(AXE.is_file(), "web/node_modules/axe-core (npm ci)")
    opened.set_window_size(*size)
    feature = {"name": "prefers-color-scheme", "value": theme}
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    opened.execute_script(AXE.read_text(encoding="utf-8"))
    result = opened.execute_async_script("axe.run().then(arguments[0])")
    told = [(each["id"], [n["html"][:80] for n in each["nodes"]]) for each in result["violations"]]
    assert result["passes"] and not told
    wide = "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert opened.execute_script(wide) <= 0


def test_nothing_is_asked_of_anybody(opened):
    asked = [
        json.loads(entry["message"])["message"]["params"]["request"]["url"]
        for entry in opened.get_log("performance")
        if "Network.requestWillBeSent" in entry["message"]
        and "request" in json.loads(entry["message"])["message"]["params"]
    ]
    assert {each.split(":")[0] for each in asked} <= {"file", "data", "chrome"}
    assert not [each for each in opened.get_log("browser") if each["level"] == "SEVERE"]
