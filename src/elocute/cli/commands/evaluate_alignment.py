"""`elocute evaluate alignment`: methods of alignment against known times of phones."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from elocute.cli import options
from elocute.cli.progress import progress_bar
from elocute.errors import InputError, needs_extra

DEFAULT_METHODS = "diagonal,dtw,softdtw,ctw,dctw,cca-soft,dcaw"
COLUMNS = ("method", "error frames", "p of error", "overlap", "p of overlap", "found")
NOISE_RANGE_DB = (-20.0, 60.0)


def alignment_command(
    folder: Path = typer.Argument(
        ..., help="Folder of WORD/NAME.wav, each with its phones in WORD/NAME.json."
    ),
    sentences: Path | None = typer.Option(
        None, help="Folder of the same words in sentences, in which they are to be found."
    ),
    methods: str = typer.Option(
        DEFAULT_METHODS,
        help="Methods to compare, separated by commas. METHOD/together is fitted once, to all "
        "words; /expected reads its expected path, /features its features by DTW.",
    ),
    ablation: bool = typer.Option(
        False, help="Compare learned methods with and without each of their parts instead."
    ),
    together: bool = typer.Option(
        False, help="With --ablation: fit learned methods once, to all words."
    ),
    tested: str | None = typer.Option(
        None, help="Method to test against each other one; dcaw where it is among them."
    ),
    encoder: str = options.AlignmentEncoder,
    noise_db: float | None = typer.Option(
        None, help="Add babble at this ratio of speech to noise, in decibels."
    ),
    words: int | None = typer.Option(None, min=1, help="Use only this many words, from the first."),
    seed: int = options.LearningSeed,
    per_word: bool = typer.Option(False, help="Also print every word."),
    table: list[Path] | None = options.Table,
    overwrite: bool = options.OverwriteTable,
    no_clobber: bool = options.KeepTable,
    as_json: bool = options.Json,
) -> None:
    """Compare alignments by the error (Eq. 11) and overlap of phones that they carry over.

    NAME.json is {"phones": [[start_s, end_s, phone], …]}, with "word": [start_s, end_s] in
    sentences.
    """
    from elocute.cli.outputs import plan_files
    from elocute.cli.tables import check_tables, write_tables

    with needs_extra("alignment", "wild"):
        from elocute.alignment.sound_views import check_view_name
        from elocute.evaluation.alignment_scores import (
            ablation_variants,
            compare_methods,
            method_variant,
            score_folder,
            word_names,
        )
    _check_noise(noise_db)
    names = _method_names(methods)
    for place in (folder, sentences):
        if place is not None and not place.is_dir():
            raise InputError.about(place, found="not a folder", allowed="a folder of words")
    check_view_name(encoder)
    variants = ablation_variants(together) if ablation else list(map(method_variant, names))
    known = [each.name for each in variants]
    if tested is not None and tested not in known:
        raise InputError.about("--tested", found=tested, allowed=", ".join(known))
    files = check_tables(table)
    plan = plan_files([folder], files, overwrite, no_clobber)
    with progress_bar("aligning", as_json) as progress:
        rows, broken = score_folder(
            folder,
            variants,
            sentences=sentences,
            encoder=encoder,
            noise_db=noise_db,
            words=word_names(folder, sentences)[:words],
            seed=seed,
            on_word=lambda share, _rows: progress(share),
        )
    by_method = compare_methods(
        rows, tested or ("dcaw/together" if ablation and together else "dcaw")
    )
    write_tables(plan, files, COLUMNS, [_cells(name, cells) for name, cells in by_method.items()])
    if as_json:
        record: dict[str, Any] = {"methods": by_method, "encoder": encoder, "left_out": broken}
        print(json.dumps(record | ({"words": list(map(asdict, rows))} if per_word else {})))
    else:
        if per_word:
            for row in rows:
                print(f"{row.word:16} {row.method:28} {row.error_frames:7.3f} {row.overlap:6.3f}")
        print_table(by_method)
    for line in broken:
        print(f"elocute: {line}", file=sys.stderr)
    if broken:
        raise typer.Exit(1)


def _check_noise(noise_db: float | None) -> None:
    low, high = NOISE_RANGE_DB
    if noise_db is not None and not low <= noise_db <= high:
        raise InputError.about("--noise-db", found=f"{noise_db}", allowed=f"{low:g} to {high:g}")


def _method_names(methods: str) -> list[str]:
    """The names between commas, each once. Raises InputError for none."""
    names = list(dict.fromkeys(name.strip() for name in methods.split(",") if name.strip()))
    if not names:
        raise InputError.about(f"--methods {methods!r}", found="none", allowed=DEFAULT_METHODS)
    return names


def _cells(method: str, cells: dict[str, Any]) -> list[Any]:
    tests = cells.get("against", {})
    ps = [tests[m]["p"] if tests else None for m in ("error_frames", "overlap")]
    return [method, cells["error_frames"], ps[0], cells["overlap"], ps[1], cells["found"]]


def print_table(table: dict[str, dict[str, Any]]) -> None:
    """One line per method; p is of the gain of the tested method over it."""
    print(
        f"{'method':28} {'error':>8} {'p':>8} {'overlap':>8} {'p':>8} {'found':>7}   "
        "error in frames: lower is better; overlap, found: higher"
    )
    for method, cells in table.items():
        tests = cells.get("against", {})
        ps = [f"{tests[m]['p']:8.2g}" if tests else " " * 8 for m in ("error_frames", "overlap")]
        print(
            f"{method:28} {cells['error_frames']:8.3f} {ps[0]} {cells['overlap']:8.3f} {ps[1]}"
            f" {cells['found']:7.3f}"
        )
