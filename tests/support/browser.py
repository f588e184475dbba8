"""A headless Chromium, as tests of pages start one."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def headless_browser(need: Callable[[object, str], None], profile: Path) -> Iterator[Any]:
    """A driver; it is ended with the block. Skips where there is no browser."""
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
        "window-size=600,600",
        f"user-data-dir={profile}",
    ):
        options.add_argument(f"--{flag}")
    driver = webdriver.Chrome(
        options=options, service=webdriver.ChromeService(shutil.which("chromedriver"))
    )
    try:
        yield driver
    finally:
        driver.quit()
