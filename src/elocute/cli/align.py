"""`elocute align`: two recordings of the same words warped onto each other."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.outputs import plan_files
from elocute.cli.progress import told_progress
from elocute.errors import InputError, OutputError, needs_extra

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elocute.alignment.alignment import Alignment

METHODS = ("dtw", "softdtw", "ctw", "dctw", "cca-soft", "dcaw")


def align_command(
    source: Path = typer.Argument(..., help="The recording that is warped."),
    target: Path = typer.Argument(..., help="The recording that it is warped onto."),
    method: str = typer.Option(
        "softdtw", help=f"One of {', '.join(METHODS)}; the last three learn, for a minute or more."
    ),
    encoder: str = typer.Option(
        "fbank", help="Speech encoder: fbank, phones, …; windows: 41 x 128 x 3."
    ),
    find: bool = typer.Option(False, help="Find the target (a word) in the source (a sentence)."),
    band: float | None = typer.Option(
        None, help="How far from the diagonal: frames (1 or more) or a share (below 1)."
    ),
    seed: int = typer.Option(0, min=0, max=options.SEED_MAX, help="Seed of the learned methods."),
    plot: Path | None = typer.Option(
        None, help="A .png: both spectrograms, and the path over what it is read from."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Which frame of one recording belongs to which of another, and how well they agree.

    Soft-DTW takes a second. Learned methods (ctw, dctw, cca-soft, dcaw) are fitted to these two
    recordings alone; over many recordings of a word they are better
    (`elocute.alignment.fit_aligner`).

    --plot draws the attention of methods that have one, beside it or instead the posterior of
    those that read their path by soft-DTW, and otherwise how near the features are.
    """
    from elocute.audio.read import read_audio
    from elocute.encoders.protocol import FEATURE_RATE

    if plot is not None and plot.suffix.lower() != ".png":
        raise OutputError.about(plot, found=f"suffix {plot.suffix!r}", allowed=".png")
    plan = plan_files([source, target], [plot], overwrite, no_clobber)
    with needs_extra("alignment", "wild"):
        from elocute.alignment import methods, sound_views
    chosen = methods.resolve_method(method)
    windows = {"windows": True} if (method, encoder) == ("dcaw", sound_views.WINDOWS) else {}
    config = chosen.config(band=band, open_source=find, **windows)
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

        title = f"{source.name} onto {target.name}: {method}, score {found.score:.3f}"
        with plan.writing(plot):
            plot_alignment(sounds, matrices_to_draw(found), found.path, plot, title)
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


def matrices_to_draw(found: Alignment) -> dict[str, NDArray[np.float32]]:
    """Attention and posterior of an alignment by name; where it has neither, minus distances."""
    named = {"attention": found.attention, "posterior of soft-DTW": found.posterior}
    known = {name: matrix for name, matrix in named.items() if matrix is not None}
    if known:
        return known
    from elocute.alignment.dtw import squared_distances

    return {"minus the distance of features": -squared_distances(*found.features)}
