#!/usr/bin/env python3
"""Build the extension for Blender: a zip for Preferences › Get Extensions › Install from Disk.

    python scripts/blender_extension.py [FOLDER]    writes elocute_blender-VERSION.zip, into build/

The same sources give the same bytes.
"""

from __future__ import annotations

import re
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "integrations/blender/elocute"
VERSION = ROOT / "src/elocute/_version.py"
DATE = (1980, 1, 1, 0, 0, 0)


def build(folder: Path) -> Path:
    """Write the zip into a folder; where it is."""
    found = re.search(r'"(\d+\.\d+\.\d+)', VERSION.read_text(encoding="utf-8"))
    if found is None:
        raise SystemExit(f"{VERSION}: no version")
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"elocute_blender-{found[1]}.zip"
    with zipfile.ZipFile(target, "w") as package:
        for file in sorted([*SOURCE.glob("*.py"), SOURCE / "blender_manifest.toml"]):
            text = file.read_text(encoding="utf-8")
            if file.suffix == ".toml":
                text = re.sub(r"^version = .*$", f'version = "{found[1]}"', text, flags=re.M)
            entry = zipfile.ZipInfo(file.name, DATE)
            entry.external_attr = 0o644 << 16
            package.writestr(entry, text, zipfile.ZIP_DEFLATED)
    return target


if __name__ == "__main__":
    print(build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build"))
