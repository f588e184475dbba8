"""`elocute align`: two recordings of the same words warped onto each other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.outputs import check_file_suffix, plan_files
from elocute.cli.progress import logged_progress
from elocute.errors import InputError, needs_extra

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elocute.alignment.alignment import Alignment
    from elocute.audio.waveform import Waveform

METHODS = ("dtw", "softdtw", "ctw", "dctw", "cca-soft", "dcaw")
LONGEST_S = 600.0
LARGEST_S2 = 8000.0
"""The seconds of one recording times those of the other: every frame of one is held against every
frame of the other, in 1 GB of memory at most."""


def align_command(
    source: Path = typer.Argument(..., help="Recording to warp."),
    target: Path = typer.Argument(..., help="Recording to warp it onto."),
    method: str = typer.Option(
        "softdtw",
        help=f"Method: {', '.join(METHODS)}. The last three train a network.",
    ),
    encoder: str = options.AlignmentEncoder,
    find: bool = typer.Option(False, help="Find the target (a word) in the source (a sentence)."),
    band: float | None = typer.Option(
        None,
        help="Largest distance of the path from the diagonal: frames (1 or more) or a share "
        "(below 1).",
    ),
    seed: int = options.LearningSeed,
    plot: Path | None = typer.Option(
        None, help="Draw both spectrograms, and the path over what it is read from (.png)."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Align two recordings of the same words in time, and score how well they agree.

    Soft-DTW takes a second. Learned methods (ctw, dctw, cca-soft, dcaw) are fitted to these two
    recordings alone; fitted to many recordings of a word (`elocute.alignment.fit_aligner`) they are
    better.

    --plot draws the attention of a method that has one and, apart, the posterior of one that reads
    its path by soft-DTW; for other methods, how near the features are.
    """
    from elocute.audio.read import probe_audio, read_audio
    from elocute.encoders.protocol import FEATURE_RATE

    check_file_suffix(plot, ".png")
    plan = plan_files([source, target], [plot], overwrite, no_clobber)
    with needs_extra("alignment", "wild"):
        from elocute.alignment import methods, sound_views
    chosen = methods.resolve_method(method)
    windows = {"windows": True} if (method, encoder) == ("dcaw", sound_views.WINDOWS) else {}
    config = chosen.config(band=band, open_source=find, **windows)
    paths = (source, target)
    _check_lengths(paths, [probe_audio(path).duration_s or 0.0 for path in paths])
    sounds = [read_audio(path) for path in paths]
    _check_lengths(paths, [sound.duration_s for sound in sounds])
    views = [_view(*pair, encoder) for pair in zip(paths, sounds, strict=True)]
    with logged_progress(f"fitting {method}", as_json) as progress:
        alignment = methods.align(views, method, config, seed, progress)
    if plot is not None and plan.wants(plot):
        title = f"{source.name} onto {target.name}: {method}, score {alignment.score:.3f}"
        with plan.writing(plot):
            _plot(sounds, alignment, plot, title)
    if as_json:
        record: dict[str, Any] = {"method": method, "encoder": encoder, "score": alignment.score}
        record |= {"rate_hz": FEATURE_RATE, "frames": [len(view) for view in views]}
        print(json.dumps(record | {"path": alignment.path.tolist()}))
    else:
        _show(alignment, source.name, find)


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


def _view(path: Path, sound: Waveform, encoder: str) -> NDArray[np.floating]:
    """(frame, feature) of a sound. Raises InputError that names its file."""
    from elocute.alignment.sound_views import speech_view

    try:
        return speech_view(sound, encoder)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _plot(sounds: list[Waveform], alignment: Alignment, path: Path, title: str) -> None:
    """The path over attention and posterior or, where there is neither, over the costs."""
    from elocute.alignment.dtw import squared_distances
    from elocute.plots.alignment import plot_alignment

    named = {"attention": alignment.attention, "posterior of soft-DTW": alignment.posterior}
    matrices = {name: matrix for name, matrix in named.items() if matrix is not None}
    if not matrices:
        matrices = {"minus the distance of features": -squared_distances(*alignment.features)}
    plot_alignment(sounds, matrices, alignment.path, path, title)


def _show(alignment: Alignment, source: str, find: bool) -> None:
    from elocute.encoders.protocol import FEATURE_RATE

    print(f"score   {alignment.score:.3f} (mean correlation along the path, 0 to 1)")
    print(f"steps   {len(alignment.path)} at {FEATURE_RATE:g} Hz")
    if find:
        start, end = alignment.path[0, 0] / FEATURE_RATE, (alignment.path[-1, 0] + 1) / FEATURE_RATE
        print(f"found   {start:.2f} to {end:.2f} s of {source}")
    else:
        shift = (alignment.path[:, 0] - alignment.path[:, 1]) / FEATURE_RATE
        print(f"shift   {shift.min():+.2f} to {shift.max():+.2f} s of {source}")
