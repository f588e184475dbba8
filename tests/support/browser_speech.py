"""`web/speech` in a real browser, with what Python exports for it, on a server of this machine."""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np

from elocute.encoders.trunk import SHIPPED_PATH
from elocute.models.browser_tables import browser_tables
from tests.support.browser import eventually, headless_browser
from tests.support.three_js import MODULES, WEB, node_program

PAGE = """<!doctype html><meta charset=utf-8><title>speech</title>
<script type=importmap>{"imports": {"onnxruntime-web/wasm": "/ort/ort.wasm.min.mjs"}}</script>
<script type=module>
import * as ort from "onnxruntime-web/wasm";
import { createSpeech } from "/speech/index.js";
import { Mel } from "/speech/mel.js";
import { Resampler } from "/speech/resample.js";

ort.env.wasm.numThreads = 1;
const bytes = async (name) => (await fetch(`/data/${name}`, { cache: "no-store" })).arrayBuffer();
const floats = async (name) => new Float32Array(await bytes(name));
const tables = await (await fetch("/tables.json")).json();
const { session } = await createSpeech({ ort, trunk: "/trunk.onnx", tables });
// All frames of a sound that is pushed in blocks of so many samples.
async function spoken(samples, size, settings) {
  const speech = await createSpeech({ ort, trunk: session, tables, ...settings }), parts = [];
  for (let at = 0; at < samples.length; at += size) {
    parts.push(await speech.push(samples.subarray(at, at + size)));
  }
  parts.push(await speech.flush());
  return parts.flatMap((part) => (part ? [...part.values] : []));
}
window.elocute = { ort, tables, session, bytes, floats, createSpeech, spoken, Mel, Resampler };
document.body.classList.add("ready");
</script><body>
"""


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is printed for each request."""


@contextlib.contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a folder, on the loopback."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


class SpeechPage:
    """A page that has `elocute.createSpeech`, and the data that it is given."""

    def __init__(self, driver: Any, data: Path) -> None:
        self._driver, self._data = driver, data

    def give(self, name: str, values: np.ndarray) -> None:
        """An array as the page gets it by `elocute.floats`."""
        values.tofile(self._data / name)

    def run(self, code: str, *given: object) -> Any:
        """What an asynchronous function of that body returns; AssertionError where it throws."""
        told = self._driver.execute_async_script(
            "const done = arguments[arguments.length - 1];"
            f"(async (...given) => {{ {code} }})(...arguments)"
            ".then((value) => done({ value }), (error) => done({ error: `${error.stack}` }));",
            *given,
        )
        assert "error" not in told, told["error"]
        return told["value"]

    def processor_s(self) -> float:
        """Seconds of a processor that the page's thread has taken so far."""
        self._driver.execute_cdp_cmd("Performance.enable", {})
        told = self._driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return next(each["value"] for each in told if each["name"] == "ThreadTime")


@contextlib.contextmanager
def open_speech_page(need: Callable[[object, str], None], folder: Path) -> Iterator[SpeechPage]:
    """The page; `folder` is empty."""
    node_program(need)
    need((MODULES / "onnxruntime-web").is_dir(), "onnxruntime-web in web/node_modules (npm ci)")
    (folder / "data").mkdir()
    (folder / "ort").symlink_to((MODULES / "onnxruntime-web" / "dist").resolve())
    (folder / "speech").symlink_to((WEB / "speech").resolve())
    (folder / "trunk.onnx").symlink_to(SHIPPED_PATH.resolve())
    (folder / "tables.json").write_text(json.dumps(browser_tables()))
    (folder / "index.html").write_text(PAGE)
    with served(folder) as address, headless_browser(need, folder / "profile") as driver:
        driver.set_script_timeout(180)
        driver.get(address)
        wait = "return document.body.classList.contains('ready')"
        assert eventually(lambda: driver.execute_script(wait)), driver.get_log("browser")
        yield SpeechPage(driver, folder / "data")
