"""A small picture maker for looking at the head while it is being built (needs EGL)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

VERTEX_SHADER = """
#version 330
uniform mat4 projection; uniform vec3 eye;
in vec3 position; in vec3 normal; in vec4 colour;
out vec3 n; out vec3 view; out vec4 c;
void main() {
    gl_Position = projection * vec4(position, 1.0);
    n = normal; view = eye - position; c = colour;
}
"""
FRAGMENT_SHADER = """
#version 330
in vec3 n; in vec3 view; in vec4 c;
out vec4 pixel;
const vec3 KEY = normalize(vec3(-0.55, 0.55, 0.9));
const vec3 FILL = normalize(vec3(0.9, 0.1, 0.6));
const vec3 RIM = normalize(vec3(0.3, 0.8, -0.8));
float wrapped(float x) { return max(0.0, (x + 0.25) / 1.25); }
void main() {
    vec3 N = normalize(n), V = normalize(view);
    if (dot(N, V) < 0.0) N = -N;
    vec3 albedo = pow(c.rgb, vec3(2.2));
    vec3 light = vec3(0.16, 0.17, 0.20) + 0.85 * wrapped(dot(N, KEY)) * vec3(1.0, 0.95, 0.9)
        + 0.30 * wrapped(dot(N, FILL)) * vec3(0.9, 0.95, 1.0) + 0.35 * max(0.0, dot(N, RIM));
    float shine = 0.10 * pow(max(0.0, dot(N, normalize(KEY + V))), 24.0);
    vec3 lit = (albedo * light + shine) * c.a;
    pixel = vec4(pow(lit, vec3(1.0 / 2.2)), 1.0);
}
"""


@dataclass(frozen=True)
class Camera:
    target: tuple[float, float, float]
    distance_m: float
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    field_deg: float = 20.0


class Preview:
    """Draws one mesh of triangles with vertex colours and occlusion."""

    def __init__(self, triangles: np.ndarray, size: tuple[int, int] = (360, 420)) -> None:
        import moderngl

        self.triangles = np.asarray(triangles, np.int32)
        self.size = size
        self.context = moderngl.create_context(standalone=True, backend="egl")
        self.program = self.context.program(VERTEX_SHADER, FRAGMENT_SHADER)
        self.samples = self.context.framebuffer(
            [self.context.renderbuffer(size, samples=4)],
            self.context.depth_renderbuffer(size, samples=4),
        )
        self.resolved = self.context.framebuffer([self.context.renderbuffer(size)])
        self.indices = self.context.buffer(self.triangles.tobytes())

    def draw(
        self, vertices: np.ndarray, colours: np.ndarray, occlusion: np.ndarray, camera: Camera
    ) -> Image.Image:
        import moderngl

        data = np.concatenate(
            [
                vertices,
                vertex_normals(vertices, self.triangles),
                colours / 255 if colours.dtype == np.uint8 else colours,
                occlusion[:, None],
            ],
            1,
        ).astype("f4")
        projection, eye = _projection(camera, self.size[0] / self.size[1])
        self.program["projection"].write(projection.T.astype("f4").tobytes())
        self.program["eye"].value = tuple(eye)
        buffer = self.context.buffer(data.tobytes())
        array = self.context.vertex_array(
            self.program, [(buffer, "3f 3f 4f", "position", "normal", "colour")], self.indices
        )
        self.samples.use()
        self.context.enable(moderngl.DEPTH_TEST)
        self.samples.clear(0.22, 0.24, 0.28)
        array.render()
        self.context.copy_framebuffer(self.resolved, self.samples)
        pixels = self.resolved.read(components=3)
        array.release()
        buffer.release()
        image = Image.frombytes("RGB", self.size, pixels)
        return image.transpose(Image.Transpose.FLIP_TOP_BOTTOM)


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    face = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normals, triangles[:, i], face)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def _projection(camera: Camera, aspect: float) -> tuple[np.ndarray, np.ndarray]:
    yaw, pitch = np.radians(camera.yaw_deg), np.radians(camera.pitch_deg)
    away = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    eye = np.asarray(camera.target) + away * camera.distance_m
    right = np.cross([0, 1, 0], away)
    right /= np.linalg.norm(right)
    look = np.eye(4)
    look[:3, :3] = [right, np.cross(away, right), away]
    look[:3, 3] = -look[:3, :3] @ eye
    near, far = camera.distance_m * 0.3, camera.distance_m * 3
    f = 1 / np.tan(np.radians(camera.field_deg) / 2)
    lens = np.array(
        [
            [f / aspect, 0, 0, 0],
            [0, f, 0, 0],
            [0, 0, (far + near) / (near - far), 2 * far * near / (near - far)],
            [0, 0, -1, 0],
        ]
    )
    return lens @ look, eye


def labelled(image: Image.Image, text: str) -> Image.Image:
    ImageDraw.Draw(image).text((6, 4), text, fill=(255, 255, 255))
    return image


def sheet(images: list[Image.Image], columns: int) -> Image.Image:
    width, height = images[0].size
    rows = -(-len(images) // columns)
    whole = Image.new("RGB", (columns * width, rows * height))
    for i, image in enumerate(images):
        whole.paste(image, (i % columns * width, i // columns * height))
    return whole
