"""`elocute render` and `elocute measure`: what can be done with a stored motion."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.progress import progress_bar


def render_command(
    motion: Path = typer.Argument(..., help="A motion (.npz) that `animate` wrote."),
    output: list[Path] = options.Output,
    audio: Path | None = typer.Option(None, help="The sound it belongs to."),
    fps: float | None = typer.Option(None, help="Sample at another frame rate."),
    size: str = options.Size,
    backend: str = options.Backend,
    embed_audio: bool = options.EmbedAudio,
    as_json: bool = options.Json,
) -> None:
    """Write a stored motion as video, glTF, HTML, meshes, curves or pictures."""
    from elocute.export.registry import check_suffix, write
    from elocute.files.atomic import check_output
    from elocute.motion.store import load_motion

    for target in output:
        check_suffix(target)
        check_output(target)
        options.writer_options(target, size, backend, embed_audio)
    loaded = load_motion(motion)
    if fps is not None:
        loaded = loaded.at_fps(fps)
    for target in output:
        extra = options.writer_options(target, size, backend, embed_audio)
        with progress_bar(f"writing {target.name}", as_json) as progress:
            write(loaded, target, sound=audio, progress=progress, **extra)
        if not as_json:
            print(target)
    if as_json:
        record = {"input": str(motion), "outputs": [str(target) for target in output]}
        print(json.dumps(record | {"frames": loaded.frame_count, "fps": loaded.fps}))


def measure_command(
    motion: Path = typer.Argument(..., help="A motion (.npz) that `animate` wrote."),
    output: Path = typer.Option(..., "-o", "--output", help="CSV to write."),
    plot: Path | None = typer.Option(None, help="Also draw the measures over time (.png)."),
    as_json: bool = options.Json,
) -> None:
    """Measure the mouth per frame: opening, width, protrusion and jaw, in millimetres."""
    from elocute.errors import OutputError
    from elocute.files.atomic import check_output
    from elocute.motion.measures import measure_mouth, write_measures
    from elocute.motion.store import load_motion

    for path, suffix in ((output, ".csv"), (plot, ".png")):
        if path is not None:
            check_output(path)
            if path.suffix.lower() != suffix:
                raise OutputError.about(path, found=f"suffix {path.suffix!r}", allowed=suffix)
    measures = measure_mouth(load_motion(motion))
    write_measures(measures, output)
    if plot is not None:
        from elocute.export.plot import plot_curves

        plot_curves(measures, plot, title=motion.name)
    if as_json:
        peaks = zip(measures.names, measures.values.max(axis=0).tolist(), strict=True)
        record = {"frames": len(measures.values), "fps": measures.fps}
        print(json.dumps(record | {f"max_{name}": round(peak, 3) for name, peak in peaks}))
    else:
        print(output, *([plot] if plot else []), sep="\n")
