"""The studio's page: its size, when it is painted, how soon a head speaks, how fast edits are seen.

    python -m benchmarks.studio_page [--sound speech.wav]

In a headless Chromium, whose graphics are software (SwiftShader), against `elocute studio`.
"""

from __future__ import annotations

import argparse
import gzip
import re
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elocute.export.html import page_asset
from tests.support.browser import eventually, headless_browser
from tests.support.commands import SAME_ELOCUTE, python

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
SHOWN = (
    "const { studio, player } = elocute;"
    "return Boolean(player.take && player.take === studio.take.value && !studio.computing.value)"
)
PAINT = "return performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000"
REDRAW = """
const { player } = elocute, started = performance.now(), moments = 200;
for (let step = 0; step < moments; step++) player.jump(player.duration * step / moments);
return (performance.now() - started) / moments;
"""


def need(there: object, what: str) -> None:
    if not there:
        raise SystemExit(f"needs {what}")


def seconds(does: Callable[[], object], driver: Any, until: str) -> float:
    """From doing something until a condition of the page holds."""
    started = time.perf_counter()
    does()
    if not eventually(lambda: driver.execute_script(until)):
        raise SystemExit(f"the page never came so far: {driver.get_log('browser')}")
    return time.perf_counter() - started


def measure(driver: Any, address: str, sound: Path) -> None:
    driver.get(address)
    for _ in range(2):
        eventually(
            lambda: driver.execute_script("return document.body.classList.contains('ready')")
        )
        print(f"first paint           {driver.execute_script(PAINT):6.2f} s")
        driver.refresh()
    eventually(lambda: driver.execute_script("return document.body.classList.contains('ready')"))
    files = driver.find_element("css selector", "input[type=file]")
    first = seconds(lambda: files.send_keys(str(sound)), driver, SHOWN)
    print(f"dropped to speaking   {first:6.2f} s")
    edit = (
        "const { studio } = elocute, phones = studio.phones.value.map((each) => [...each]);"
        "phones[5][1] += 0.02; phones[6][0] += 0.02;"
        "studio.change({ ...studio.saved.value, phones });"
    )
    moved = seconds(lambda: driver.execute_script(edit), driver, SHOWN)
    print(f"phone moved to shown  {moved:6.2f} s")
    undone = seconds(lambda: driver.execute_script("elocute.studio.undo()"), driver, SHOWN)
    print(f"undone to shown       {undone:6.2f} s")
    print(f"page's work a frame   {driver.execute_script(REDRAW):6.3f} ms beside the head")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--sound", type=Path, default=EXAMPLE)
    sound = parser.parse_args().sound.resolve()
    packed = [gzip.compress(page_asset(name).encode()) for name in ("studio.html", "studio.js")]
    print(f"page, packed          {sum(map(len, packed)) / 1e6:6.2f} MB, three.js in it")
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / "takes"
        folder.mkdir()
        words = python("-m", "elocute", "studio", folder, "--no-open", "--port", "0")
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=SAME_ELOCUTE) as server:
            assert server.stdout is not None
            (address,) = re.findall(r"http://\S+", server.stdout.readline())
            with headless_browser(need, Path(room) / "profile", "1440,900") as driver:
                measure(driver, address, sound)
            server.terminate()


if __name__ == "__main__":
    main()
