"""A renderer as picture options ask for it: camera, lights and ground."""

from __future__ import annotations

from elocute.export.background import read_backdrop
from elocute.export.options import PictureOptions
from elocute.export.render import Renderer, Stage, open_renderer, portrait
from elocute.export.render.lights import RIGS
from elocute.head.model import HeadModel


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
