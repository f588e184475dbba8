"""Make a folder with a page that hears speech and moves a head, in the browser alone.

(cd web && npm ci)                               # of this repository, once
python examples/browser/make.py OUT
python -m http.server --bind 127.0.0.1 --directory OUT

Drop a sound onto the page, or speak. Nothing leaves the browser; any static server will do.
"""

import argparse
import shutil
import subprocess
from pathlib import Path

import numpy as np

import elocute
from elocute.export import head_page
from elocute.models import write_browser_tables

HERE = Path(__file__).resolve().parent
WEB = HERE.parents[1] / "web"
RUNTIME = WEB / "node_modules" / "onnxruntime-web" / "dist"
RUNTIME_FILES = (
    "ort.wasm.min.mjs",
    "ort-wasm-simd-threaded.mjs",
    "ort-wasm-simd-threaded.wasm",
)


def bundled(script: str) -> str:
    """A script with all that it imports, but the network's runtime."""
    options = "--bundle --minify --format=esm --target=es2022 --external:onnxruntime-web/wasm"
    command = [WEB / "node_modules" / ".bin" / "esbuild", HERE / script, *options.split()]
    made = subprocess.run(command, check=True, capture_output=True, text=True)
    return made.stdout.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def page(identity: str) -> str:
    """The page with a head that rests."""
    silence = np.zeros(800, np.float32)
    motion = elocute.animate(silence, rate=16000, identity=identity, life=0).motion
    own = {"@BASE@": (WEB / "src" / "base.css").read_text(encoding="utf-8")}
    html = (HERE / "page.html").read_text(encoding="utf-8")
    return "".join(
        head_page(html, bundled("page.js"), motion.dressed(), "Elocute", "studio", {}, own)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Make a page that animates speech by itself.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--identity", default="mean", help="whose head it is, such as ada")
    given = parser.parse_args()
    write_browser_tables(given.folder)
    (given.folder / "index.html").write_text(page(given.identity), encoding="utf-8")
    (given.folder / "worker.js").write_text(bundled("worker.js"), encoding="utf-8")
    for name in RUNTIME_FILES:
        shutil.copyfile(RUNTIME / name, given.folder / name)


if __name__ == "__main__":
    main()
