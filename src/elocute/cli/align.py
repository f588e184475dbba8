"""`elocute align`: two recordings of the same words warped onto each other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.outputs import plan_files
from elocute.cli.progress import told_progress
from elocute.errors import InputError, OutputError, needs_extra

METHODS = ("dtw", "softdtw", "ctw", "dctw", "dcaw")
LONGEST_S = 600.0
LARGEST_S2 = 8000.0
"""The seconds of one recording times those of the other: every frame of one is held against every
frame of the other, in 1 GB of memory at most."""


def align_command(
    source: Path = typer.Argument(..., help="The recording that is warped."),
    target: Path = typer.Argument(..., help="The recording that it is warped onto."),
    method: str = typer.Option(
        "softdtw", help=f"One of {', '.join(METHODS)}; the last two learn, for a minute or more."
    ),
    encoder: str = typer.Option("fbank", help="Speech encoder: fbank, phones, …"),
    find: bool = typer.Option(False, help="Find the target (a word) in the source (a sentence)."),
    band: float | None = typer.Option(
        None, help="How far from the diagonal: frames (1 or more) or a share (below 1)."
    ),
    seed: int = typer.Option(0, min=0, max=options.SEED_MAX, help="Seed of the learned methods."),
    plot: Path | None = typer.Option(None, help="A .png: both spectrograms, attention, path."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Which frame of one recording belongs to which of another, and how well they agree.

    Soft-DTW takes a second. Learned methods (ctw, dctw, dcaw) are fitted to these two recordings
    alone; over many recordings of a word they are better (`elocute.alignment.fit_aligner`).
    """
    from elocute.audio.read import probe_audio, read_audio
    from elocute.encoders.protocol import FEATURE_RATE

    if plot is not None and plot.suffix.lower() != ".png":
        raise OutputError.about(plot, found=f"suffix {plot.suffix!r}", allowed=".png")
    plan = plan_files([source, target], [plot], overwrite, no_clobber)
    with needs_extra("alignment", "wild"):
        from elocute.alignment import methods, sound_views
    chosen = methods.resolve_method(method)
    config = chosen.config(band=band, open_source=find)
    paths = (source, target)
    _check_lengths(paths, [probe_audio(path).duration_s or 0.0 for path in paths])
    sounds = [read_audio(path) for path in paths]
    _check_lengths(paths, [sound.duration_s for sound in sounds])
    views = []
    for path, sound in zip(paths, sounds, strict=True):
        try:
            views.append(sound_views.speech_view(sound, encoder))
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
    with told_progress(f"fitting {method}", as_json) as progress:
        found = methods.align(views, method, config, seed, progress)
    if plot is not None and plan.wants(plot):
        from elocute.export.alignment_plot import plot_alignment

        matrix = found.attention
        title = f"{source.name} onto {target.name}: {method}, score {found.score:.3f}"
        if matrix is None:
            from elocute.alignment.dtw import squared_distances

            matrix = -squared_distances(*found.features)
        with plan.writing(plot):
            plot_alignment(sounds, matrix, found.path, plot, title)
    rate = FEATURE_RATE
    if as_json:
        print(
            json.dumps(
                {
                    "method": method,
                    "encoder": encoder,
                    "score": found.score,
                    "rate_hz": rate,
                    "frames": [len(view) for view in views],
                    "path": found.path.tolist(),
                }
            )
        )
        return
    shift = (found.path[:, 0] - found.path[:, 1]) / rate
    print(f"score   {found.score:.3f} (mean correlation along the path, 0 to 1)")
    print(f"steps   {len(found.path)} at {rate:g} Hz")
    if find:
        start, end = found.path[0, 0] / rate, (found.path[-1, 0] + 1) / rate
        print(f"found   {start:.2f} to {end:.2f} s of {source.name}")
    else:
        print(f"shift   {shift.min():+.2f} to {shift.max():+.2f} s of {source.name}")


def _check_lengths(paths: Sequence[Path], durations_s: Sequence[float]) -> None:
    """Refuse recordings that would take the machine's memory. Raises InputError."""
    for path, seconds in zip(paths, durations_s, strict=True):
        if seconds > LONGEST_S:
            raise InputError.about(
                path, found=f"{seconds:.1f} s", allowed=f"up to {LONGEST_S:g} s", remedy="cut it"
            )
    source, target = durations_s
    if source * target > LARGEST_S2:
        raise InputError.about(
            paths[0],
            found=f"{source:.1f} s, with {target:.1f} s of {paths[1].name}",
            allowed=f"up to {LARGEST_S2**0.5:.0f} s each, or {LONGEST_S:g} s with "
            f"{LARGEST_S2 / LONGEST_S:.0f} s",
            remedy="cut them",
        )
