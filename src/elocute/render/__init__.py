"""Pictures of heads: one interface, two engines, the same shading."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.render.backends_and_views import BACKENDS as BACKENDS, VIEWS as VIEWS
    from elocute.render.camera import Camera as Camera, portrait as portrait
    from elocute.render.engine import (
        Renderer as Renderer,
        available_backends as available_backends,
        open_renderer as open_renderer,
        picture_size as picture_size,
    )
    from elocute.render.stage import Stage as Stage

__getattr__, __dir__ = lazy(__name__, __file__)
