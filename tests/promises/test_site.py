"""The documentation builds without a warning, leads nowhere wrong, and reads from disk alone."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag, urlsplit

import pytest

from tests.support.browser import eventually, headless_browser
from tests.support.commands import run_python

pytest.importorskip("mkdocs", reason="needs the dependency group `dev`")

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
LOADED = {
    "script": ("src",),
    "link": ("href",),
    "img": ("src", "srcset"),
    "iframe": ("src",),
    "source": ("src", "srcset"),
    "video": ("src",),
    "audio": ("src",),
    "object": ("data",),
    "use": ("href", "xlink:href"),
}
"""Elements that a browser fetches something for, and the attributes that say what."""


class Page(HTMLParser):
    """What a page loads, what it links to, and the places in it that links may name."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.loads: list[str] = []
        self.links: list[str] = []
        self.places: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value for name, value in attrs if value is not None}
        self.places |= {given[name] for name in ("id", "name") if name in given}
        self.loads += [given[name] for name in LOADED.get(tag, ()) if name in given]
        if tag == "a" and "href" in given:
            self.links.append(given["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if built := os.environ.get("ELOCUTE_SITE"):  # by scripts/check, as strictly as here
        return Path(built)
    folder = tmp_path_factory.mktemp("site")
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    build = "mkdocs", "build", "--strict", "--site-dir", folder
    done = run_python("-m", *build, cwd=ROOT, env=quiet)
    assert done.returncode == 0 and "WARNING" not in done.stderr, done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path.resolve(): Page(path) for path in site.rglob("*.html")}


def test_every_document_has_a_page(site: Path) -> None:
    for document in (ROOT / "docs").rglob("*.md"):
        assert (site / document.relative_to(ROOT / "docs").with_suffix(".html")).is_file()
    for made in ("index", "contributing", "changelog", "security", "reference/commands"):
        assert (site / f"{made}.html").is_file()


def test_no_page_loads_anything_from_another_host(site: Path, pages: dict[Path, Page]) -> None:
    loaded = {what for page in pages.values() for what in page.loads}
    assert [what for what in loaded if urlsplit(what).scheme or what.startswith("//")] == []
    styles = [path.read_text(encoding="utf-8") for path in site.rglob("*.css")]
    assert styles and not any("url(http" in text or "@import" in text for text in styles)


def test_every_link_inside_resolves(site: Path, pages: dict[Path, Page]) -> None:
    broken = []
    for page in pages.values():
        if page.path.name == "404.html":
            continue  # its links start at the root of a server
        for link in (*page.links, *page.loads):
            if urlsplit(link).scheme:
                continue
            path, place = urldefrag(unquote(link))
            target = (page.path.parent / path).resolve() if path else page.path.resolve()
            there = target.is_file() and target.is_relative_to(site.resolve())
            if not there or (place and target in pages and place not in pages[target].places):
                broken.append(f"{page.path.relative_to(site)}: {link}")
    assert broken == []


def test_every_command_and_public_package_is_in_the_reference(site: Path) -> None:
    from elocute.cli.examples import EXAMPLES

    page = (site / "reference/commands.html").read_text(encoding="utf-8")
    for name in EXAMPLES:
        assert f'id="{" ".join(["elocute", *name.split()]).replace(" ", "-")}"' in page
    assert 'id="elocute.animate"' in (site / "reference/api/elocute.html").read_text("utf-8")


@pytest.fixture(scope="module")
def browser(need: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "1280,900") as driver:
        yield driver


@pytest.mark.browser
@pytest.mark.parametrize("page", ["index.html", "use/animate.html", "reference/api/elocute.html"])
def test_a_page_reads_from_disk_without_a_network(browser: Any, site: Path, page: str) -> None:
    browser.get("about:blank")
    browser.get_log("performance")
    browser.get_log("browser")
    browser.get((site / page).as_uri())
    heading = browser.find_element("css selector", "article h1")
    assert heading.is_displayed() and heading.size["height"] > 20
    found = search(browser, "look-ahead")
    assert any("Live" in title for title in found)
    records = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [
        record["params"]["request"]["url"]
        for record in records
        if record["method"] in ("Network.requestWillBeSent", "Network.webSocketCreated")
        and "request" in record["params"]
    ]
    assert any(url.endswith(page) for url in asked)
    assert [url for url in asked if url.startswith(("http", "ws"))] == []
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def search(browser: Any, words: str) -> list[str]:
    """Titles that the page's own search finds."""
    field = browser.find_element("css selector", "[data-md-component=search-query]")
    browser.execute_script("arguments[0].focus()", field)
    field.send_keys(words)
    items = "css selector", ".md-search-result__item h1"
    assert eventually(lambda: browser.find_elements(*items))
    found = browser.find_elements(*items)
    return [browser.execute_script("return arguments[0].innerText", one) for one in found]
