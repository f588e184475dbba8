"""`elocute align`: two recordings of the same words warped onto each other."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.outputs import plan_files
from elocute.cli.progress import told_progress
from elocute.errors import InputError, OutputError, needs_extra

METHODS = ("dtw", "softdtw", "ctw", "dctw", "dcaw")


def align_command(
    source: Path = typer.Argument(..., help="Recording to warp."),
    target: Path = typer.Argument(..., help="Recording to warp it onto."),
    method: str = typer.Option(
        "softdtw",
        help=f"Method: {', '.join(METHODS)}. The last two train a network for a minute or more.",
    ),
    encoder: str = typer.Option("fbank", help="Speech encoder: fbank, phones and the like."),
    find: bool = typer.Option(False, help="Find the target (a word) in the source (a sentence)."),
    band: float | None = typer.Option(
        None,
        help="How far from the diagonal the path may go: frames (1 or more) or a share (below 1).",
    ),
    seed: int = options.LearningSeed,
    plot: Path | None = typer.Option(
        None, help="Draw both spectrograms, the attention and the path (.png)."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Align two recordings of the same words in time, and score how well they agree.

    Soft-DTW takes a second. Learned methods (ctw, dctw, dcaw) are fitted to these two recordings
    alone; fitted to many recordings of a word (`elocute.alignment.fit_aligner`) they are better.
    """
    from elocute.audio.read import read_audio
    from elocute.encoders.protocol import FEATURE_RATE

    if plot is not None and plot.suffix.lower() != ".png":
        raise OutputError.about(plot, found=f"suffix {plot.suffix!r}", allowed=".png")
    plan = plan_files([source, target], [plot], overwrite, no_clobber)
    with needs_extra("alignment", "wild"):
        from elocute.alignment import methods, sound_views
    chosen = methods.resolve_method(method)
    config = chosen.config(band=band, open_source=find)
    sounds = [read_audio(path) for path in (source, target)]
    views = []
    for path, sound in zip((source, target), sounds, strict=True):
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
