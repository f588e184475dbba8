"""Sets up a renderer from picture options: camera, lights and ground."""

from __future__ import annotations

from elocute.export.options import PictureOptions
from elocute.head.model import HeadModel
from elocute.render import Renderer, Stage, open_renderer, portrait
from elocute.render.background import read_backdrop
from elocute.render.lights import RIGS


def open_pictures(head: HeadModel, size: tuple[int, int], options: PictureOptions) -> Renderer:
    """A renderer of one head.

    Parameters
    ----------
    head : HeadModel
        What is drawn.
    size : (int, int)
        Width and height of a picture, pixels: that of the options is a sheet's or a video's.
    options : PictureOptions
        Everything else.

    Returns
    -------
    Renderer
        A context manager. Pictures have a fourth channel, straight alpha, where the background is
        transparent.

    Raises
    ------
    OutputError
        For a background that cannot be read.
    MachineError
        Where no renderer works.
    """
    camera = portrait(head, options.view, framing=options.framing, aspect=size[0] / size[1])
    stage = Stage(
        RIGS[options.light],
        quality=options.quality,
        backdrop=read_backdrop(options.background),
        transparent=options.transparent,
    )
    return open_renderer(head, size, backend=options.backend, camera=camera, stage=stage)
