"""A picture of the studio: a take with its edits, and on a phone.

    python -m recipes.studio_picture [--out docs/images/studio.jpg]

Needs Chromium and its driver; the graphics may be software.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from elocute.studio.project import Project
from recipes.example import SENTENCES
from recipes.head.sheets import EXAMPLE
from recipes.viewer_picture import need, save_side_by_side, screen
from tests.support.browser import eventually, headless_browser
from tests.support.commands import SAME_ELOCUTE, python

DESK, PHONE = (1440, 860), (400, 860)
AT_S, CHOSEN = 2.2, 12
EDITS = (
    {"edit": "mood", "mood": "happy:0.8", "from": 2.2, "to": 4.1},
    {"edit": "closed", "from": 3.7, "to": 4.05},
    {"edit": "blinks", "add": [3.0]},
    {
        "edit": "curve",
        "curve": "jawOpen",
        "keys": [[5.4, 0.2], [5.8, 0.4], [6.3, 0.1]],
        "from": 5.15,
        "to": 6.55,
        "blend": 0.2,
    },
)
SHOWN = (
    "return Boolean(window.elocute?.player.take && elocute.studio.peaks.value.min.length &&"
    " !elocute.studio.computing.value)"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    place = Path(__file__).parents[1] / "docs" / "images" / "studio.jpg"
    parser.add_argument("--out", type=Path, default=place)
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / "takes"
        folder.mkdir()
        shutil.copy(EXAMPLE, folder / "reading.flac")
        settings = {"identity": "esi"}
        text = " ".join(SENTENCES)
        Project(folder, "reading.flac", text=text, edits=EDITS, settings=settings).save(
            folder / "reading.elocute.json"
        )
        asked = folder / "reading.elocute.json"
        words = python("-m", "elocute", "studio", asked, "--no-open", "--port", "0")
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=SAME_ELOCUTE) as server:
            assert server.stdout is not None
            (address,) = re.findall(r"http://\S+", server.stdout.readline())
            with headless_browser(need, Path(room) / "profile") as driver:
                driver.set_script_timeout(120)
                driver.get(address)
                eventually(lambda: driver.execute_script(SHOWN))
                dark = "document.documentElement.dataset.theme = 'dark';"
                chosen = f"elocute.studio.selection.value = {{ kind: 'phones', index: {CHOSEN} }};"
                at = f"elocute.player.jump({AT_S});"
                pictures = [screen(driver, size, dark + chosen + at) for size in (DESK, PHONE)]
            server.terminate()
    save_side_by_side(pictures, out)


if __name__ == "__main__":
    main()
