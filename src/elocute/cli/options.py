"""Options that several commands share, and what their texts mean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from elocute.errors import InputError

SIZES = {"720p": (1280, 720), "1080p": (1920, 1080), "4k": (3840, 2160)}
SIDE_RANGE = (64, 4096)
SEED_MAX = 2**32 - 1

Output = typer.Option(
    ...,
    "-o",
    "--output",
    help="Where to write; the suffix chooses the format. May be given several times.",
)
Overwrite = typer.Option(False, "--overwrite", help="Replace files that are there already.")
NoClobber = typer.Option(
    False, "--no-clobber", help="Leave files that are there already as they are, and say so."
)
Size = typer.Option("800", help="Picture size: 800, 1280x720, 720p, 1080p, 4k.")
Backend = typer.Option("auto", help="Renderer: auto, moderngl or embreex.")
EmbedAudio = typer.Option(False, help="Put the sound into the .glb instead of beside it.")
StyleName = typer.Option(
    "plain", "--style", help="Speaking style: a name, a mix (calm:0.7,broad:0.3), or a .json file."
)
Model = typer.Option(
    "articulation",
    "--model",
    help="What drives the face: articulation, voca, crnn or an .onnx.",
)
Head = typer.Option(
    "builtin", "--head", help="builtin, or a head or mesh file in the topology of the model."
)
Split = typer.Option("default", help="Which split of the corpus.")
Table = typer.Option(
    None, "--table", help="Also write the table: .csv or .tex. May be given several times."
)
Json = typer.Option(False, "--json", help="Print one JSON record for machines.")

_PICTURES = (".mp4", ".png")


def parse_size(text: str) -> tuple[int, int]:
    """Width and height in pixels. Raises InputError."""
    if text in SIZES:
        return SIZES[text]
    parts = text.lower().split("x")
    low, high = SIDE_RANGE
    if len(parts) <= 2 and all(map(_is_side, parts)):
        return int(parts[0]), int(parts[-1])
    raise InputError.about(
        f"--size {text[:60]}",
        found="no picture size",
        allowed=f"one number or WIDTHxHEIGHT, {low} to {high}, or {', '.join(SIZES)}",
    )


def _is_side(text: str) -> bool:
    """Whether it is a number of pixels; only so many digits are looked at."""
    low, high = SIDE_RANGE
    return text.isdecimal() and len(text) <= len(str(high)) and low <= int(text) <= high


def writer_options(path: Path, size: str, backend: str, embed_audio: bool) -> dict[str, Any]:
    """The options that the writer for this suffix takes."""
    if path.suffix.lower() in _PICTURES:
        return {"size": parse_size(size), "backend": backend}
    return {"embed_audio": embed_audio} if path.suffix.lower() == ".glb" else {}
