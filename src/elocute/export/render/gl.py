"""OpenGL without a window (EGL), on a graphics card or in software."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.render import shading
from elocute.export.render.camera import Camera
from elocute.export.surface import vertex_normals
from elocute.head.model import HeadModel

SAMPLES = 4

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
    if (dot(N, V) < 0.0 && !gl_FrontFacing) N = -N;
    pixel = vec4(shade(paint.rgb, paint.a), 1.0);
}
"""
_BACK_VERTEX = """
#version 330
in vec2 corner; out float down;
void main() { gl_Position = vec4(corner, 0.999999, 1.0); down = 0.5 - 0.5 * corner.y; }
"""
_BACK_FRAGMENT = """
#version 330
uniform sampler2D rows; in float down; out vec4 pixel;
void main() { pixel = vec4(texture(rows, vec2(0.5, down)).rgb, 1.0); }
"""


def _context() -> Any:
    import moderngl

    return moderngl.create_context(standalone=True, backend="egl", require=330)


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
        self._program = self._gl.program(_VERTEX, _FRAGMENT.replace("SHADE", shading.glsl()))
        self._program["projection"].write(camera.matrix(size[0] / size[1]).T.tobytes())
        self._program["eye"].value = tuple(float(x) for x in camera.position)
        self._moving = self._gl.buffer(reserve=head.vertex_count * 24, dynamic=True)
        surfaces = shading.vertex_surfaces(head)
        indices = np.ascontiguousarray(self._triangles, np.int32)
        self._array = self._gl.vertex_array(
            self._program,
            [
                (self._moving, "3f 3f", "position", "normal"),
                (self._gl.buffer(surfaces.tobytes()), "4f 3f", "albedo", "surface"),
            ],
            self._gl.buffer(indices.tobytes()),
        )
        self._backdrop()
        samples = min(SAMPLES, self._gl.max_samples)
        self._drawn = self._gl.framebuffer(
            [self._gl.renderbuffer(size, 4, samples=samples)],
            self._gl.depth_renderbuffer(size, samples=samples),
        )
        self._resolved = self._gl.framebuffer([self._gl.renderbuffer(size, 4)])

    def _backdrop(self) -> None:
        import moderngl

        rows = (shading.background(self._size[1]) * 255 + 0.5).astype(np.uint8)
        self._rows = self._gl.texture((1, self._size[1]), 3, rows.tobytes(), alignment=1)
        self._rows.filter = (moderngl.LINEAR, moderngl.LINEAR)
        program = self._gl.program(_BACK_VERTEX, _BACK_FRAGMENT)
        corners = np.array([-1, -1, 3, -1, -1, 3], np.float32)
        self._back = self._gl.vertex_array(
            program, [(self._gl.buffer(corners.tobytes()), "2f", "corner")]
        )

    def frame(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """(height, width, 3) picture of vertices (vertex, 3) m."""
        import moderngl

        normals = vertex_normals(points, self._triangles)
        self._moving.write(np.concatenate([points, normals], axis=1).astype(np.float32).tobytes())
        self._drawn.use()
        self._drawn.clear(depth=1.0)
        self._rows.use()
        self._gl.disable(moderngl.DEPTH_TEST)
        self._back.render()
        self._gl.enable(moderngl.DEPTH_TEST)
        self._array.render()
        self._gl.copy_framebuffer(self._resolved, self._drawn)
        raw = self._resolved.read(components=4, alignment=1)
        picture = np.frombuffer(raw, np.uint8).reshape(self._size[1], self._size[0], 4)
        return np.ascontiguousarray(picture[::-1, :, :3])

    def __enter__(self) -> GlRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._gl.release()
