"""A picture of the viewer: dark, light with its menus, and on a phone.

    python -m recipes.viewer_picture [--out docs/images/viewer.jpg]

Needs Chromium and its driver; the graphics may be software.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

from elocute.animation import animate
from recipes.example import SENTENCES
from recipes.head.sheets import EXAMPLE, QUALITY
from tests.support.browser import headless_browser, open_viewer

WHO, AT_S, GAP = "esi", 2.2, 8
DESK, PHONE = (1100, 700), (390, 700)
SHARE = 2 / 3  # of the pixels a side that are kept
SHOWN = (
    (DESK, "document.documentElement.dataset.theme = 'dark';"),
    (DESK, "theme.click(); more.click(); views.children[1].click(); downloads.open = true;"),
    (PHONE, "theme.click(); more.click(); views.children[0].click(); downloads.open = false;"),
)
SETTLED_MS = 2500
"""A page that draws in software halves its pixels while it moves."""


def need(there: object, what: str) -> None:
    if not there:
        raise SystemExit(f"needs {what}")


def seen(driver: Any, size: tuple[int, int], clicks: str) -> Image.Image:
    """The page in a window of a size, after some of its elements were clicked."""
    names = ("theme", "more", "views", "downloads")
    found = " ".join(f"const {name} = document.getElementById('{name}');" for name in names)
    return screen(driver, size, f"{found} {clicks} elocute.jump({AT_S}); elocute.show();")


def screen(driver: Any, size: tuple[int, int], code: str) -> Image.Image:
    """A window of a size, once its code has run and nothing moves any more."""
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    driver.execute_async_script(f"{code} setTimeout(arguments[0], {SETTLED_MS});")
    return Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")


def save_side_by_side(pictures: list[Image.Image], out: Path) -> None:
    """Screens beside each other, smaller, as one picture."""
    wide = sum(picture.width for picture in pictures) + GAP * (len(pictures) - 1)
    whole = Image.new("RGB", (wide, max(each.height for each in pictures)), (255, 255, 255))
    x = 0
    for picture in pictures:
        whole.paste(picture, (x, 0))
        x += picture.width + GAP
    small = (round(SHARE * whole.width), round(SHARE * whole.height))
    whole = whole.resize(small, Image.Resampling.LANCZOS)
    whole.save(out, quality=QUALITY, optimize=True)
    print(f"{out}: {out.stat().st_size / 1000:.0f} kB")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    place = Path(__file__).parents[1] / "docs" / "images" / "viewer.jpg"
    parser.add_argument("--out", type=Path, default=place)
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "talk.html"
        animate(EXAMPLE, identity=WHO, text=" ".join(SENTENCES)).write(page)
        with headless_browser(need, Path(folder) / "profile") as driver:
            driver.set_script_timeout(120)
            open_viewer(driver, page)
            pictures = [seen(driver, size, clicks) for size, clicks in SHOWN]
    save_side_by_side(pictures, out)


if __name__ == "__main__":
    main()
