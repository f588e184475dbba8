"""A picture of a study's page: on a desk while faces speak, and on a phone once one is chosen.

    python -m recipes.study_picture [--out docs/images/study.jpg]

Needs Chromium, its driver and the extra `study`; the graphics may be software.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

from elocute.study.stimuli.stimuli import make_stimuli
from recipes.head.sheets import QUALITY
from recipes.viewer_picture import need
from tests.study.participant import Participant
from tests.study.studies import QUICK, served
from tests.support.browser import headless_browser

STUDY = Path(__file__).parents[1] / "studies" / "example.toml"
DESK, PHONE, GAP = (1180, 720), (390, 720), 16
SPOKEN_S = 1.1


def seen(driver: Any) -> Image.Image:
    return Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")


def resize(driver: Any, size: tuple[int, int]) -> None:
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def pictures(driver: Any, host: str) -> list[Image.Image]:
    """The page while its video plays, and with an answer chosen."""
    resize(driver, DESK)
    person = Participant(driver, host)
    person.begin()
    person.click(".stage + .row button")
    person.until(f"document.querySelector('video').currentTime > {SPOKEN_S}")
    playing = seen(driver)
    person.until("!document.querySelector('fieldset').disabled")
    person.choose(1)
    resize(driver, PHONE)
    person.run("scrollTo(0, 0)")
    return [playing, seen(driver)]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    place = Path(__file__).parents[1] / "docs" / "images" / "study.jpg"
    parser.add_argument("--out", type=Path, default=place)
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder) / "study.toml"
        plan.write_text(STUDY.read_text(encoding="utf-8") + QUICK, encoding="utf-8")
        made = Path(folder) / "study"
        make_stimuli(plan, made)
        with served(made) as host, headless_browser(need, Path(folder) / "profile") as driver:
            desk, phone = pictures(driver, host)
    whole = Image.new("RGB", (desk.width + GAP + phone.width, DESK[1]), (255, 255, 255))
    whole.paste(desk, (0, 0))
    whole.paste(phone, (desk.width + GAP, 0))
    whole.save(out, quality=QUALITY, optimize=True)
    print(f"{out}: {out.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
