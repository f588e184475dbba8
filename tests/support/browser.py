"""A headless Chromium, as tests of pages start one."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PATIENCE_S = 180.0


@contextmanager
def headless_browser(
    need: Callable[[object, str], None],
    profile: Path,
    size: str = "600,600",
    flags: Sequence[str] = (),
) -> Iterator[Any]:
    """A driver; it is ended with the block. Skips where there is no browser.

    Its logs "browser" and "performance" tell errors, and what was asked of whom.
    """
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    need(chromium and shutil.which("chromedriver"), "chromium and chromium-driver")
    assert chromium is not None
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (
        "headless",
        "no-sandbox",
        "use-angle=swiftshader",
        "enable-unsafe-swiftshader",
        "disable-quic",
        "no-first-run",
        "disable-background-networking",
        "disable-component-update",
        "disable-sync",
        "mute-audio",
        "autoplay-policy=no-user-gesture-required",
        f"window-size={size}",
        f"user-data-dir={profile}",
        *flags,
    ):
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(
        options=options, service=webdriver.ChromeService(shutil.which("chromedriver"))
    )
    try:
        yield driver
    finally:
        driver.quit()


def open_viewer(driver: Any, page: Path) -> None:
    """Open a page of the viewer, and wait until its head is there."""
    driver.get(page.as_uri())
    wait_for_viewer(driver)


def wait_for_viewer(driver: Any) -> None:
    ready = "return document.body.classList.contains('ready')"
    if not eventually(lambda: driver.execute_script(ready)):
        raise AssertionError(f"the page never got ready: {driver.get_log('browser')}")


def eventually(happens: Callable[[], object]) -> bool:
    """Whether something comes true: at once on a quiet machine, later on a busy one."""
    until = time.monotonic() + PATIENCE_S
    while not happens():
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True
