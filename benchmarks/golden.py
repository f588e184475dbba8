"""Golden digests: the same sound must give the same files, bit for bit, on one machine.

    python -m benchmarks.golden -o before.json           # before a change of layout
    python -m benchmarks.golden --against before.json    # after it; exit 1 where a file differs

Digests hold on one machine with one set of libraries; they are compared, never committed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
from pathlib import Path

import elocute

SPEECH = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
FORMATS = (".npz", ".csv", ".glb")
TAKES: dict[str, dict[str, object]] = {
    "talkers": {},
    "talkers, broad, a seed, 30 fps": {"style": "broad", "identity": "7", "fps": 30.0},
    "talkers, without life": {"life": 0},
    "articulation": {"model": "articulation"},
    "voca": {"model": "voca"},
    "crnn": {"model": "crnn", "identity": "hana"},
}


def digests(speech: Path) -> dict[str, str]:
    """SHA-256 of every take in every format."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, settings in TAKES.items():
            take = elocute.animate(speech, **settings)  # pyright: ignore[reportArgumentType]
            for suffix in FORMATS:
                path = Path(folder, f"take{suffix}")
                take.write(path)
                found[f"{name} {suffix}"] = hashlib.sha256(path.read_bytes()).hexdigest()
                path.unlink()
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--speech", type=Path, default=SPEECH)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--against", type=Path)
    given = parser.parse_args()
    found = digests(given.speech)
    if given.output:
        given.output.write_text(json.dumps(found, indent=1) + "\n")
    before = json.loads(given.against.read_text()) if given.against else found
    changed = [name for name in before if found.get(name) != before[name]]
    for name, digest in found.items():
        print(f"{digest[:16]}  {name}{'  CHANGED' if name in changed else ''}")
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
