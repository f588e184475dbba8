"""OpenGL without a window (EGL), on a graphics card or in software."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel
from elocute.head.surface import IMAGES
from elocute.render import gl_shaders
from elocute.render.camera import Camera, ShadowView, shadow_view
from elocute.render.parts import Image, Part, Parts
from elocute.render.stage import Stage

SRGB_ALPHA = 0x8C43  # GL_SRGB8_ALPHA8: linear light when sampled
UNITS = {
    "color_map": 0,
    "normal_map": 1,
    "roughness_map": 2,
    "shadow_map": 3,
    "folds_map": 4,
    "drawn": 0,
    "backdrop": 1,
}


def _context() -> Any:
    import moderngl

    settings: Any = {"backend": "egl"}  # the library's own annotation of it is wrong
    return moderngl.create_context(standalone=True, require=330, **settings)


def describe() -> str:
    """The driver's name; raises whatever the driver raises where there is none."""
    context = _context()
    name = str(context.info["GL_RENDERER"])
    context.release()
    return name


class GlRenderer:
    """One head in one OpenGL context."""

    def __init__(
        self, head: HeadModel, size: tuple[int, int], camera: Camera, stage: Stage
    ) -> None:
        self._gl = _context()
        self._size = size
        stage = stage.for_driver(str(self._gl.info["GL_RENDERER"]))
        self._stage = stage
        parts = Parts(head, stage.profile.image_side)
        self._parts = parts
        self._moving = self._gl.buffer(reserve=len(parts.source) * 24, dynamic=True)
        fixed = np.concatenate([parts.at, parts.color, parts.occlusion[:, None], parts.strand], 1)
        self._fixed = self._gl.buffer(fixed.astype(np.float32).tobytes())
        if parts.fold_masks is not None:
            self._zones = self._gl.buffer(np.ascontiguousarray(parts.fold_masks).tobytes())
        self._folding: list[Any] = []
        self._inside: list[Any] = []
        self._indices = {
            part.name: self._gl.buffer(np.ascontiguousarray(part.triangles).tobytes())
            for part in parts.parts
        }
        self._images: dict[tuple[str, str], Any] = {}
        for part in parts.parts:
            for kind in IMAGES:
                if (image := getattr(part, kind)) is not None:
                    self._images[part.name, kind] = texture = self._image(image)
                    texture.repeat_x = texture.repeat_y = part.repeats
        self._projection = camera.matrix(size[0] / size[1])
        self._shared: dict[str, Any] = {
            "projection": self._projection.T,
            "key_view": shadow_view(head, stage.rig).matrix.T,
            "eye": camera.position,
            "exposure": parts.exposure(stage.rig),
        }
        self._shadow = _Shadow(self, shadow_view(head, stage.rig))
        # What hides others is drawn first; then what is solid from the outside in.
        cards = [part for part in parts.parts if not part.solid]
        cores = [part for part in cards if part.core <= 1]
        solid = [part for part in parts.parts if part.solid]
        self._solid = [(self._drawing(part), part) for part in (*cores, *solid)]
        # Depths alone; what is solid before cards, as much of these lies behind the head.
        self._depths = [
            (self.array(self.program(gl_shaders.VERTEX_AT, fragment), part), part)
            for part, fragment in (
                *((part, gl_shaders.HIDING) for part in solid if cores),
                *((part, gl_shaders.cover(part, stage.rig)) for part in cores),
            )
        ]
        # What is sheer lies close on the skin, under the hair.
        fringed = sorted(
            (part for part in cards if part.surface.fringed), key=lambda part: -part.core
        )
        self._fringes = [(self._drawing(part, fringe=True), part) for part in fringed]
        scale = stage.profile.oversampling
        large = (round(size[0] * scale), round(size[1] * scale))
        self._texture = self._gl.texture(large, 4)
        self._drawn = self._gl.framebuffer([self._texture], self._gl.depth_renderbuffer(large))
        self._finished = self._gl.framebuffer([self._gl.renderbuffer(size, 4)])
        self._finish = self.overlay(gl_shaders.finishing(stage), gl_shaders.TURNED_OVERLAY)
        for name, value in (("step_size", (1 / large[0], 1 / large[1])), ("high", size[1])):
            if name in self._finish.program:
                self._finish.program[name].value = value
        if stage.backdrop is not None:
            self._backdrop = self._gl.texture(size, 3, stage.backdrop_for(size)[::-1].tobytes())
        self._channels = 4 if stage.transparent else 3
        self._free: list[Any] = []
        self._empty = self._gl.framebuffer([self._gl.renderbuffer(size, 4)])
        self._drawn.clear(0.0, 0.0, 0.0, 0.0)
        self._lay(self._empty)

    def program(self, vertex: str, fragment: str) -> Any:
        """A program with what all of them share set in it."""
        program = self._gl.program(vertex, fragment)
        for name, value in self._shared.items():
            if name in program:
                array = np.ascontiguousarray(value, np.float32)
                program[name].write(array.tobytes())
        for name, unit in UNITS.items():
            if name in program:
                program[name].value = unit
        return program

    def overlay(self, fragment: str, vertex: str = gl_shaders.OVERLAY) -> Any:
        """One triangle over the whole target."""
        program = self.program(vertex, fragment)
        corners = np.array([-1, -1, 3, -1, -1, 3], np.float32)
        return self._gl.vertex_array(
            program, [(self._gl.buffer(corners.tobytes()), "2f", "corner")]
        )

    def array(self, program: Any, part: Part) -> Any:
        """The faces of a part, as a program takes them."""
        moving, fixed = ["3f", "3f"], ["2f", "3f", "1f", "3f"]
        places = (("position", "normal"), ("texcoord", "color", "occlusion", "strand"))
        buffers = []
        for buffer, formats, names in (
            (self._moving, moving, places[0]),
            (self._fixed, fixed, places[1]),
        ):
            used = [name for name in names if name in program]
            layout = " ".join(
                form if name in used else f"{4 * int(form[0])}x"
                for form, name in zip(formats, names, strict=True)
            )
            if used:
                buffers.append((buffer, layout, *used))
        if "fold_strengths" in program:
            buffers.append((self._zones, "4f1 4f1 4f1 4f1", *(f"folds_{k}" for k in range(4))))
            self._folding.append(program)
        if "opening" in program:
            self._inside.append(program)
        return self._gl.vertex_array(program, buffers, self._indices[part.name])

    def bind(self, part: Part) -> None:
        """Make a part's images those that are sampled."""
        for kind in IMAGES:
            if (part.name, kind) in self._images:
                self._images[part.name, kind].use(UNITS[f"{kind}_map"])

    def _image(self, image: Image) -> Any:
        import moderngl as gl

        profile = self._stage.profile
        high, wide = image.pixels.shape[:2]
        data = np.ascontiguousarray(image.pixels[::-1]).tobytes()
        kind = {"internal_format": SRGB_ALPHA} if image.srgb else {}
        texture = self._gl.texture((wide, high), 4, data, **kind)
        texture.build_mipmaps()
        between = gl.LINEAR_MIPMAP_LINEAR if profile.blended_levels else gl.LINEAR_MIPMAP_NEAREST
        texture.filter = between, gl.LINEAR
        if profile.anisotropy > 1 and (image.pixels[..., 3] == 255).all():
            # Mesa's software sampler leaves single wrong texels of images with alpha otherwise.
            texture.anisotropy = profile.anisotropy
        return texture

    def _drawing(self, part: Part, *, fringe: bool = False) -> Any:
        rig, glows = self._stage.rig, part.rounded and self._stage.profile.hair_at_vertices
        source = gl_shaders.surface(part, rig, glows, fringe=fringe)
        return self.array(self.program(gl_shaders.vertex(part, rig, glows), source), part)

    def frame(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """(height, width, 3 or 4) picture of vertices (vertex, 3) m."""
        return next(self.frames([points]))

    def frames(self, faces: Iterable[NDArray[np.float32]]) -> Iterator[NDArray[np.uint8]]:
        """One `frame` for each: the card draws one while the next face is taken and prepared."""
        waiting = None
        for points in faces:
            drawn = self._drawn_to_buffer(points)
            if waiting is not None:
                yield self._taken(waiting)
            waiting = drawn
        if waiting is not None:
            yield self._taken(waiting)

    def _drawn_to_buffer(self, points: NDArray[np.float32]) -> Any:
        """A buffer that the card will have read its picture into: nothing waits for it here."""
        channels, pixels = self._channels, self._size[0] * self._size[1]
        with self._gl:  # several renderers may live in one process
            buffer = self._free.pop() if self._free else self._gl.buffer(reserve=pixels * channels)
            self._draw(points)
            self._finished.read_into(buffer, components=channels, alignment=1)
        return buffer

    def _taken(self, buffer: Any) -> NDArray[np.uint8]:
        """The picture in a buffer, once it is there."""
        picture = np.empty((self._size[1], self._size[0], self._channels), np.uint8)
        with self._gl:
            buffer.read_into(picture)
        self._free.append(buffer)
        return picture

    def _draw(self, points: NDArray[np.float32]) -> None:
        import moderngl

        gl = self._gl
        self._moving.orphan()  # the frame before may still be drawn from it
        self._moving.write(self._parts.moved(points).tobytes())
        if self._folding:
            strengths = self._parts.fold_strengths(points).tobytes()
            for program in self._folding:
                program["fold_strengths"].write(strengths)
        if self._inside:
            opening = self._parts.opening(points).tobytes()
            for program in self._inside:
                program["opening"].write(opening)
        self._shadow.draw()
        gl.enable_only(moderngl.DEPTH_TEST)
        self._drawn.use()
        self._drawn.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        self._shadow.moments.use(UNITS["shadow_map"])
        # What lies in front is found out first: each pixel is then lit but once.
        for array, part in self._depths:
            self._sides(part)
            self.bind(part)
            array.render()
        for array, part in self._solid:
            gl.depth_func = "<=" if part.solid else "=="
            self._sides(part)
            self.bind(part)
            array.render()
        gl.depth_func = "<="
        gl.enable(moderngl.BLEND)
        gl.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        self._drawn.depth_mask = False
        for array, part in self._fringes:
            self._sides(part)
            self.bind(part)
            array.render()
        self._drawn.depth_mask = True
        gl.depth_func = "<"
        gl.enable_only(moderngl.NOTHING)
        gl.copy_framebuffer(self._finished, self._empty)
        self._finished.scissor = self._seen(points)
        self._lay(self._finished)
        self._finished.scissor = None

    def _lay(self, target: Any) -> None:
        """Smooth what was drawn and lay the ground behind it."""
        target.use()
        self._texture.use(0)
        if self._stage.backdrop is not None:
            self._backdrop.use(1)
        self._finish.render()

    def _seen(self, points: NDArray[np.float32]) -> tuple[int, int, int, int]:
        """Where in the picture the box round the head is: left, top, width and height in pixels."""
        columns = np.ascontiguousarray(points.T)  # short rows are slow to reduce
        ends = zip(columns.min(axis=1), columns.max(axis=1), strict=True)
        corners = np.stack(np.meshgrid(*ends), axis=-1).reshape(-1, 3)
        clip = np.pad(corners, ((0, 0), (0, 1)), constant_values=1) @ self._projection.T
        if (clip[:, 3] <= 0).any():  # a corner beside the camera
            return 0, 0, *self._size
        places = (clip[:, :2] / clip[:, 3:] * [0.5, -0.5] + 0.5) * self._size
        first = np.clip(np.floor(places.min(axis=0)) - 8, 0, self._size).astype(int)
        last = np.clip(np.ceil(places.max(axis=0)) + 8, 0, self._size).astype(int)
        return int(first[0]), int(first[1]), int(last[0] - first[0]), int(last[1] - first[1])

    def _sides(self, part: Part) -> None:
        """The far side of what is closed need not be drawn."""
        import moderngl

        if part.surface.both_sides:
            self._gl.disable(moderngl.CULL_FACE)
        else:
            self._gl.enable(moderngl.CULL_FACE)

    def __enter__(self) -> GlRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._gl.release()


class _Shadow:
    """Depths that the key sees: drawn, then blurred, so that one stage-up is a soft shadow."""

    def __init__(self, owner: GlRenderer, view: ShadowView) -> None:
        gl, side = owner._gl, owner._stage.profile.shadow_side
        self._gl, self._owner = gl, owner
        shape = gl_shaders.VERTEX_OF_KEY
        self._parts = [
            (owner.array(owner.program(shape, gl_shaders.depths(part)), part), part)
            for part in owner._parts.parts
            if part.casts
        ]
        self._raw = gl.texture((2 * side, 2 * side), 2, dtype="f4")
        self._seen = gl.framebuffer([self._raw], gl.depth_renderbuffer((2 * side, 2 * side)))
        self.moments = gl.texture((side, side), 2, dtype="f4")
        self._between = gl.texture((side, side), 2, dtype="f4")
        for texture in (self.moments, self._between):
            texture.repeat_x = texture.repeat_y = False
        self._half = gl.framebuffer([self._between])
        self._whole = gl.framebuffer([self.moments])
        taps = view.taps(side)
        self._across = owner.overlay(gl_shaders.blur(taps, (1 / side, 0.0)))
        self._down = owner.overlay(gl_shaders.blur(taps, (0.0, 1 / side)))

    def draw(self) -> None:
        import moderngl

        gl = self._gl
        gl.enable_only(moderngl.DEPTH_TEST)
        self._seen.use()
        self._seen.clear(1.0, 1.0, 0.0, 0.0, depth=1.0)
        for array, part in self._parts:
            self._owner.bind(part)
            array.render()
        gl.enable_only(moderngl.NOTHING)
        self._half.use()
        self._raw.use(0)
        self._across.render()
        self._whole.use()
        self._between.use(0)
        self._down.render()
