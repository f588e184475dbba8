"""OpenGL without a window (EGL), on a graphics card or in software."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.render import shading
from elocute.export.render.camera import Camera
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals

# Drawn this much larger, then reduced: in software that is thirty times faster than multisampling.
OVERSAMPLING = 2

_VERTEX = """
#version 330
uniform mat4 projection;
uniform vec3 eye;
in vec3 position; in vec3 normal; in vec4 albedo; in vec3 surface;
out vec3 n; out vec3 view; out vec4 paint; out vec3 gloss;
void main() {
    gl_Position = projection * vec4(position, 1.0);
    n = normal; view = eye - position; paint = albedo; gloss = surface;
}
"""
_FRAGMENT = """
#version 330
in vec3 n; in vec3 view; in vec4 paint; in vec3 gloss;
out vec4 pixel;
SHADE
void main() {
    N = normalize(n); V = normalize(view); material = gloss;
    pixel = vec4(shade(paint.rgb, paint.a), 1.0);
}
"""
_PLAIN_VERTEX = """
#version 330
uniform mat4 projection;
in vec3 position; in vec3 color;
out vec3 c;
void main() { gl_Position = projection * vec4(position, 1.0); c = color; }
"""
_PLAIN_FRAGMENT = """
#version 330
in vec3 c; out vec4 pixel;
void main() { pixel = vec4(c, 1.0); }
"""
_REDUCE_VERTEX = """
#version 330
in vec2 corner; out vec2 at;
void main() { gl_Position = vec4(corner, 0.0, 1.0); at = corner * 0.5 + 0.5; }
"""
_REDUCE_FRAGMENT = """
#version 330
uniform sampler2D drawn; in vec2 at; out vec4 pixel;
void main() {
    // Linear filtering at the middle of four is their mean; the ground shows where nothing is.
    vec4 head = texture(drawn, at);
    pixel = vec4(head.rgb + (1.0 - head.a) * mix(BOTTOM, TOP, at.y), 1.0);
}
"""


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

    def __init__(self, head: HeadModel, size: tuple[int, int], camera: Camera) -> None:
        self._gl = _context()
        self._size = size
        self._triangles = head.triangles
        self._surfaces = shading.vertex_surfaces(head)
        self._eye = camera.position
        self._moving = self._gl.buffer(reserve=head.vertex_count * 36, dynamic=True)
        glossy = shading.glossy_triangles(head)
        gloss = self._gl.program(_VERTEX, _FRAGMENT.replace("SHADE", shading.glsl()))
        gloss["eye"].value = tuple(float(x) for x in camera.position)
        plain = self._gl.program(_PLAIN_VERTEX, _PLAIN_FRAGMENT)
        projection = camera.matrix(size[0] / size[1]).T.tobytes()
        gloss["projection"].write(projection)
        plain["projection"].write(projection)
        surfaces = (self._gl.buffer(self._surfaces.tobytes()), "4f 3f", "albedo", "surface")
        self._arrays = [
            self._part(plain, [(self._moving, "3f 12x 3f", "position", "color")], ~glossy),
            self._part(
                gloss, [(self._moving, "3f 3f 12x", "position", "normal"), surfaces], glossy
            ),
        ]
        large = (size[0] * OVERSAMPLING, size[1] * OVERSAMPLING)
        self._texture = self._gl.texture(large, 4)
        self._drawn = self._gl.framebuffer([self._texture], self._gl.depth_renderbuffer(large))
        self._reduced = self._gl.framebuffer([self._gl.renderbuffer(size, 4)])
        self._reduce = self._reducer()

    def _part(self, program: Any, buffers: list[Any], chosen: NDArray[np.bool_]) -> Any:
        """The chosen triangles as something to draw; None where there are none."""
        if not chosen.any():
            return None
        indices = np.ascontiguousarray(self._triangles[chosen], np.int32)
        return self._gl.vertex_array(program, buffers, self._gl.buffer(indices.tobytes()))

    def _reducer(self) -> Any:
        """One triangle over the whole picture, from the large drawing to the small."""
        program = self._gl.program(_REDUCE_VERTEX, shading.with_background(_REDUCE_FRAGMENT))
        corners = np.array([-1, -1, 3, -1, -1, 3], np.float32)
        buffer = self._gl.buffer(corners.tobytes())
        return self._gl.vertex_array(program, [(buffer, "2f", "corner")])

    def frame(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """(height, width, 3) picture of vertices (vertex, 3) m."""
        with self._gl:  # several renderers may live in one process
            return self._draw(points)

    def _draw(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        import moderngl

        normals = vertex_normals(points, self._triangles)
        colors = shading.shade_vertices(points, normals, self._surfaces, self._eye)
        data = np.concatenate([points, normals, colors], axis=1).astype(np.float32)
        self._moving.write(data.tobytes())
        self._gl.enable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._drawn.use()
        self._drawn.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        for part in self._arrays:  # skin is closed: its far side need not be drawn
            if part is not None:
                part.render()
            self._gl.disable(moderngl.CULL_FACE)
        self._gl.disable(moderngl.DEPTH_TEST)
        self._reduced.use()
        self._texture.use(0)
        self._reduce.render()
        raw = self._reduced.read(components=4, alignment=1)
        picture = np.frombuffer(raw, np.uint8).reshape(self._size[1], self._size[0], 4)
        return np.ascontiguousarray(picture[::-1, :, :3])

    def __enter__(self) -> GlRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._gl.release()
