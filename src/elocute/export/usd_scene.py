"""An animated head as a USD scene in text: UsdSkel blend shapes, joints, materials and the sound.

One mesh, in metres, with the head's own vertices and faces; texture coordinates belong to corners
of faces, materials to subsets of them. jawOpen is a blend shape; the jaw joint is there to pose.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.array_types import Float32Array, FloatArray
from elocute.errors import printable
from elocute.export.gltf import joint_offsets
from elocute.export.shape_profiles import Targets
from elocute.head.model import HeadModel
from elocute.head.normals import linear_colors, morphed_normals, moved_vertices, vertex_normals
from elocute.head.surface import Surface
from elocute.motion.motion import Motion
from elocute.render.portable_pictures import PortablePicture, material_picture

NUMBER = "%.6g"
SKELETON = "/Head/Skeleton"
NORMAL_STEP = 0.02  # changes of a unit normal below this are not stored


def usd_scene(
    motion: Motion, shapes: Targets, joints: tuple[str, ...], sound: bytes | None, title: str
) -> tuple[str, dict[str, bytes]]:
    """The text of the scene of a motion, and the files that it names, by their paths there.

    Of a dressed head; joints: names of its joints; sound: a .wav. Raises HeadError for a head with
    an image that is none.
    """
    head = motion.head
    pictures = _Pictures(head)
    files = pictures.files() | ({"sound.wav": sound} if sound is not None else {})
    parts = [
        _opening(motion, title),
        'def SkelRoot "Head" (\n    prepend apiSchemas = ["SkelBindingAPI"]\n)\n{\n',
        _skeleton(motion, shapes, joints) if joints else "",
        _mesh(head, shapes, bool(joints)),
        _materials(head, pictures),
        "}\n",
        SOUND if sound is not None else "",
    ]
    return "".join(parts), files


_COORDINATES = """
            def Shader "coordinates"
            {
                uniform token info:id = "UsdPrimvarReader_float2"
                string inputs:varname = "st"
                float2 outputs:result
            }
"""
_VERTEX_COLOR = """
            def Shader "tone"
            {
                uniform token info:id = "UsdPrimvarReader_float3"
                string inputs:varname = "displayColor"
                float3 outputs:result
            }
"""
SOUND = """
def SpatialAudio "Voice"
{
    uniform token auralMode = "nonSpatial"
    uniform asset filePath = @sound.wav@
    uniform token playbackMode = "onceFromStart"
    uniform timecode startTime = 0
}
"""


def _opening(motion: Motion, title: str) -> str:
    notice = f"        string notice = {quoted(motion.head.notice)}\n" if motion.head.notice else ""
    return (
        '#usda 1.0\n(\n    customLayerData = {\n        string creator = "Elocute"\n'
        f"        string title = {quoted(title)}\n{notice}    }}\n"
        '    defaultPrim = "Head"\n'
        f"    endTimeCode = {motion.frame_count - 1}\n    framesPerSecond = {motion.fps:.12g}\n"
        "    metersPerUnit = 1\n    startTimeCode = 0\n"
        f'    timeCodesPerSecond = {motion.fps:.12g}\n    upAxis = "Y"\n)\n\n'
    )


def _joint_paths(head: HeadModel, names: tuple[str, ...]) -> list[str]:
    paths: list[str] = []
    for name, parent in zip(names, head.joint_parents, strict=True):
        paths.append(f"{paths[parent]}/{name}" if parent >= 0 else name)
    return paths


def _skeleton(motion: Motion, shapes: Targets, names: tuple[str, ...]) -> str:
    head = motion.head
    paths = tokens(_joint_paths(head, names))
    places, offsets = head.joint_positions.astype(float), joint_offsets(head)
    bind = ", ".join(matrix(_shift(place)) for place in places)
    rest = ", ".join(matrix(_shift(offset)) for offset in offsets)
    turns = _turns(motion)
    rotations = samples({code: tuples(each) for code, each in enumerate(turns)}, " " * 12)
    weights = shapes.weights(motion)
    moved = samples({code: numbers(each) for code, each in enumerate(weights)}, " " * 12)
    return f"""
    def Skeleton "Skeleton" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {{
        uniform matrix4d[] bindTransforms = [{bind}]
        uniform token[] joints = {paths}
        uniform matrix4d[] restTransforms = [{rest}]
        rel skel:animationSource = <{SKELETON}/Speech>

        def SkelAnimation "Speech"
        {{
            uniform token[] blendShapes = {tokens(map(identifier, shapes.names))}
            float[] blendShapeWeights.timeSamples = {moved}
            uniform token[] joints = {paths}
            quatf[] rotations.timeSamples = {rotations}
            half3[] scales = {tuples(np.ones_like(offsets))}
            float3[] translations = {tuples(offsets)}
        }}
    }}
"""


def _shift(offset: FloatArray) -> FloatArray:
    moved = np.eye(4)
    moved[3, :3] = offset
    return moved


def _turns(motion: Motion) -> Float32Array:
    """(frame, joint, 4) wxyz, of length one."""
    if motion.rotations is None:
        still = np.zeros((motion.frame_count, len(motion.head.joint_names), 4), np.float32)
        still[..., 0] = 1
        return still
    return motion.rotations / np.linalg.norm(motion.rotations, axis=-1, keepdims=True)


def _mesh(head: HeadModel, shapes: Targets, skinned: bool) -> str:
    corners = np.where(head.quads[:, 3] == head.quads[:, 2], 3, 4)
    kept = np.arange(4) < corners[:, None]
    normals = vertex_normals(head.template, head.triangles)
    low, high = head.template.min(axis=0), head.template.max(axis=0)
    names = [identifier(name) for name in shapes.names]
    targets = ", ".join(f"</Head/Face/{name}>" for name in names)
    return f"""
    def Mesh "Face" (
        prepend apiSchemas = ["MaterialBindingAPI", "SkelBindingAPI"]
    )
    {{
        uniform bool doubleSided = 1
        float3[] extent = {tuples([low, high])}
        int[] faceVertexCounts = {numbers(corners)}
        int[] faceVertexIndices = {numbers(head.quads[kept])}
        normal3f[] normals = {tuples(normals)} (
            interpolation = "vertex"
        )
        point3f[] points = {tuples(head.template)}
        color3f[] primvars:displayColor = {tuples(linear_colors(head))} (
            interpolation = "vertex"
        )
        texCoord2f[] primvars:st = {tuples(head.uv)} (
            interpolation = "faceVarying"
        )
        int[] primvars:st:indices = {numbers(head.uv_quads[kept])}
{_binding(head) if skinned else ""}        uniform token[] skel:blendShapes = {tokens(names)}
        rel skel:blendShapeTargets = [{targets}]
        uniform token subdivisionScheme = "none"
        uniform token subsetFamily:materialBind:familyType = "partition"
{_subsets(head)}{_blend_shapes(head, shapes)}    }}
"""


def _binding(head: HeadModel) -> str:
    """Up to four joints for each vertex."""
    joints = np.argsort(-head.skin_weights, axis=1)[:, :4]
    weights = np.take_along_axis(head.skin_weights, joints, axis=1).astype(float)
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
    size = joints.shape[1]
    return f"""        int[] primvars:skel:jointIndices = {numbers(joints)} (
            elementSize = {size}
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = {numbers(weights)} (
            elementSize = {size}
            interpolation = "vertex"
        )
        rel skel:skeleton = <{SKELETON}>
"""


def _subsets(head: HeadModel) -> str:
    """The faces of each material that has some."""
    parts = []
    for index, name in enumerate(head.material_names):
        faces = np.flatnonzero(head.material == index)
        if len(faces):
            parts.append(f"""
        def GeomSubset "{identifier(name)}_faces" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {{
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = {numbers(faces)}
            rel material:binding = </Head/Materials/{identifier(name)}>
        }}
""")
    return "".join(parts)


def shape_changes(
    head: HeadModel, basis: Float32Array
) -> Iterator[tuple[NDArray[np.intp], Float32Array, Float32Array]]:
    """Per shape of a basis (shape, vertex, 3) m: which vertices it moves or turns (row,), by how
    much (row, 3) m, and the change of their unit normals (row, 3)."""
    turns = morphed_normals(head.template, head.triangles, basis)
    for delta, (near, change) in zip(basis, turns, strict=True):
        clear = (change * change).sum(axis=1) > NORMAL_STEP**2
        moved = moved_vertices(delta)
        moved[near[clear]] = True
        rows = np.flatnonzero(moved)
        turn = np.zeros_like(delta)
        turn[near[clear]] = change[clear]
        yield rows, delta[rows], turn[rows]


def _blend_shapes(head: HeadModel, shapes: Targets) -> str:
    parts = []
    changes = shape_changes(head, shapes.basis)
    for name, (rows, delta, turn) in zip(shapes.names, changes, strict=True):
        parts.append(f"""
        def BlendShape "{identifier(name)}"
        {{
            uniform vector3f[] normalOffsets = {tuples(turn)}
            uniform vector3f[] offsets = {tuples(delta)}
            uniform int[] pointIndices = {numbers(rows)}
        }}
""")
    return "".join(parts)


class _Pictures:
    """Images of the surfaces of a head, by material and kind."""

    def __init__(self, head: HeadModel) -> None:
        self._named: dict[tuple[str, str], tuple[str, PortablePicture]] = {}
        for name in head.material_names:
            surface = head.surfaces.get(name, Surface())
            for kind in ("color", "normal", "roughness"):
                picture = material_picture(surface, kind, name)
                if picture is not None:
                    path = f"images/{identifier(name)}_{kind}{picture.suffix}"
                    self._named[name, kind] = path, picture

    def files(self) -> dict[str, bytes]:
        return {path: picture.data for path, picture in self._named.values()}

    def path(self, material: str, kind: str) -> str:
        """Empty: it has none."""
        return self._named.get((material, kind), ("", None))[0]


def _materials(head: HeadModel, pictures: _Pictures) -> str:
    each = "".join(
        _material(name, head.surfaces.get(name), pictures)
        for index, name in enumerate(head.material_names)
        if (head.material == index).any()
    )
    return f'\n    def Scope "Materials"\n    {{{each}    }}\n'


def _material(name: str, surface: Surface | None, pictures: _Pictures) -> str:
    """UsdPreviewSurface with the images of a surface, or with vertex colours."""
    surface = surface or Surface()
    place = f"/Head/Materials/{identifier(name)}"
    inputs, nodes = [], []

    def read(kind: str, node: str, into: str, output: str, **how: str) -> bool:
        path = pictures.path(name, kind)
        if path:
            nodes.append(_texture(place, node, path, output, **how))
            inputs.append(f"{into}.connect = <{place}/{node}.outputs:{output.split(':')[1]}>")
        return bool(path)

    color, tint = "color3f inputs:diffuseColor", _four(*surface.tint, 1)
    if not read("color", "color", color, "float3 outputs:rgb", scale=tint, space="sRGB"):
        nodes.append(_VERTEX_COLOR)
        inputs.append(f"{color}.connect = <{place}/tone.outputs:result>")
    # A node of its own: Blender takes the factor of the colour for the alpha's, too.
    cover = "float inputs:opacity"
    if surface.opacity != "opaque" and read("color", "cover", cover, "float outputs:a"):
        inputs.append("float inputs:opacityThreshold = 0.5")
    bent = surface.normal_scale
    scale, bias = _four(2 * bent, 2 * bent, 2, 1), _four(-bent, -bent, -1, 0)
    normal = "normal3f inputs:normal"
    read("normal", "normal", normal, "float3 outputs:rgb", scale=scale, bias=bias)
    rough = surface.roughness_factor
    roughness, scale = "float inputs:roughness", _four(rough, rough, rough, 1)
    if not read("roughness", "roughness", roughness, "float outputs:g", scale=scale):
        inputs.append(f"{roughness} = {rough:.6g}")
    lines = "".join(f"                {each}\n" for each in inputs)
    reader = _COORDINATES if pictures.path(name, "color") else ""
    return f"""
        def Material "{identifier(name)}"
        {{
            token outputs:surface.connect = <{place}/surface.outputs:surface>

            def Shader "surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
{lines}                token outputs:surface
            }}
{"".join(nodes)}{reader}        }}
"""


def _four(*parts: float) -> str:
    return f"({', '.join(f'{part:.6g}' for part in parts)})"


def _texture(
    place: str,
    node: str,
    path: str,
    output: str,
    scale: str = "",
    bias: str = "",
    space: str = "raw",
) -> str:
    more = "".join(
        f"                float4 inputs:{name} = {value}\n"
        for name, value in (("bias", bias), ("scale", scale))
        if value
    )
    return f"""
            def Shader "{node}"
            {{
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @{path}@
{more}                token inputs:sourceColorSpace = "{space}"
                float2 inputs:st.connect = <{place}/coordinates.outputs:result>
                token inputs:wrapS = "repeat"
                token inputs:wrapT = "repeat"
                {output}
            }}
"""


def quoted(text: str) -> str:
    """A string or token."""
    plain = printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{plain}"'


def identifier(name: str) -> str:
    """The name of a prim: letters, digits and underscores, no digit first."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match(r"[A-Za-z_]", plain) else f"_{plain}"


def tokens(names: Iterable[str]) -> str:
    """An array of strings or tokens."""
    return f"[{', '.join(map(quoted, names))}]"


def numbers(values: ArrayLike) -> str:
    """An array of numbers."""
    flat = np.ravel(np.asarray(values))
    kind = "%d" if np.issubdtype(flat.dtype, np.integer) else NUMBER
    return f"[{', '.join((kind,) * len(flat)) % tuple(flat.tolist())}]"


def tuples(rows: ArrayLike) -> str:
    """An array of tuples: points, quaternions (w first), texture coordinates."""
    table = np.asarray(rows, float)
    one = f"({', '.join((NUMBER,) * table.shape[1])})"
    return f"[{', '.join((one,) * len(table)) % tuple(table.ravel().tolist())}]"


def matrix(rows: NDArray[Any]) -> str:
    """A 4 x 4 matrix whose last row is the shift, as USD wants it."""
    return f"( {', '.join(tuples([row])[1:-1] for row in rows)} )"


def samples(values: Mapping[int, str], indent: str) -> str:
    """Values by time code."""
    lines = "".join(f"{indent}    {code}: {value},\n" for code, value in values.items())
    return f"{{\n{lines}{indent}}}"
