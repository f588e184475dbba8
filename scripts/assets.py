#!/usr/bin/env python3
"""Compare the binary files of the repository with scripts/assets.sha256, which lists them all.

    python scripts/assets.py            names what differs; exit code 1 where something does
    python scripts/assets.py --write    writes the list anew, after an asset was changed on purpose

Git keeps every version of a file for ever: an asset is committed once, when it is final.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIST = ROOT / "scripts" / "assets.sha256"


def assets() -> dict[str, str]:
    """The SHA-256 of every binary file that Git knows, by its path; binary as Git says."""
    told = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    data = {
        name: (ROOT / name).read_bytes() for name in told.split("\0") if (ROOT / name).is_file()
    }
    return {
        name: hashlib.sha256(each).hexdigest()
        for name, each in sorted(data.items())
        if b"\0" in each[:8000]
    }


def differences(listed: dict[str, str], there: dict[str, str]) -> list[str]:
    """A line for every asset that is not as it is listed."""
    told = {
        "not in scripts/assets.sha256": there.keys() - listed.keys(),
        "listed, but not there": listed.keys() - there.keys(),
        "not as listed": {n for n in there.keys() & listed.keys() if there[n] != listed[n]},
    }
    return [f"{name}: {what}" for what, names in told.items() for name in sorted(names)]


def main() -> int:
    there = assets()
    if sys.argv[1:] == ["--write"]:
        lines = [f"{digest}  {name}\n" for name, digest in there.items()]  # as sha256sum reads it
        LIST.write_text("".join(lines), encoding="utf-8")
        return 0
    lines = LIST.read_text(encoding="utf-8").splitlines()
    told = differences({line[66:]: line[:64] for line in lines}, there)
    if told:
        told.append("Where that is meant: python scripts/assets.py --write")
    print("\n".join(told), end="\n" if told else "")
    return bool(told)


if __name__ == "__main__":
    sys.exit(main())
