"""FBX 7.4, binary: a head with blend shapes, joints, materials with their images, and a take.

One mesh with the head's own vertices and faces, in centimetres, +Y up, as Maya and Unreal count;
programs turn and scale it to their own axes. A shape's weight is in percent, a turn in degrees.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.fbx_file import FbxFile, FbxTake, Long
from elocute.export.gltf import FACE, JOINTS, joint_offsets
from elocute.export.options import ActionOptions
from elocute.export.shape_profiles import Targets, target_shapes
from elocute.export.usd_scene import shape_changes
from elocute.files.atomic import write_atomically
from elocute.head.model import HeadModel
from elocute.head.normals import linear_colors, vertex_normals
from elocute.head.surface import Surface
from elocute.meshes.mesh_file import picture_bytes, tinted
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import to_euler_degrees
from elocute.render.portable_pictures import material_picture

CM = 100.0  # in a metre
AXES = ("X", "Y", "Z")
REFLECTED = 0.2
"""Strength of the reflection of all materials; FBX's shading knows none of physical size."""


def write_fbx(
    motion: Motion,
    path: str | Path,
    *,
    sound: object = None,
    options: ActionOptions | None = None,
    progress: Any = None,
) -> None:
    """Write an animated head as .fbx, which has no sound; it is written at once.

    Raises OutputError for a place that cannot be written, and visemes of a head that lacks the
    shapes for them; HeadError for a head with an image that is none.
    """
    with write_atomically(path) as draft:
        draft.write_bytes(fbx_bytes(motion, options))


def fbx_bytes(motion: Motion, options: ActionOptions | None = None) -> bytes:
    """An animated head as the bytes of an .fbx. Raises OutputError and HeadError as `write_fbx`."""
    options = options or ActionOptions()
    motion = motion.dressed()
    head = motion.head
    shapes = target_shapes(head, options.profile, options.visemes)
    file = FbxFile(motion.fps, motion.frame_count, options.action_name)
    take = FbxTake(file)
    mesh = _mesh(file, head)
    node = _node(file, FACE, "Mesh")
    file.join(node, 0)
    file.join(mesh, node)
    _materials(file, head, node)
    _shapes(file, take, motion, shapes, mesh)
    joints = _joints(file, head)
    _skin(file, head, mesh, node, joints)
    if motion.rotations is not None:
        for joint, turns in zip(joints, np.moveaxis(motion.rotations, 1, 0), strict=True):
            angles = to_euler_degrees(turns).T
            take.move(joint, "Lcl Rotation", dict(zip(AXES, angles, strict=True)))
    return file.pack()


def _node(file: FbxFile, name: str, form: str, place: NDArray[Any] | None = None) -> Long:
    """A node of the scene at a place (3,) m in that which it hangs from."""
    number, record = file.add("Model", name, "Model", form)
    record.add("Version", 232)
    shift = np.zeros(3) if place is None else CM * place
    record.settings(
        {
            "RotationActive": ("bool", "", "", 1),
            "InheritType": ("enum", "", "", 1),  # scales of parents come last
            "Lcl Translation": ("Lcl Translation", "", "A", *shift.tolist()),
            "Lcl Rotation": ("Lcl Rotation", "", "A", 0.0, 0.0, 0.0),
            "Lcl Scaling": ("Lcl Scaling", "", "A", 1.0, 1.0, 1.0),
            "DefaultAttributeIndex": 0,
        }
    )
    record.fill({"Culling": "CullingOff"})
    return number


def _mesh(file: FbxFile, head: HeadModel) -> Long:
    """The geometry: a triangle is a face of three corners, the last of a face counts from -1."""
    number, mesh = file.add("Geometry", FACE, "Geometry", "Mesh")
    three = head.quads[:, 3] == head.quads[:, 2]
    kept = np.arange(4) < np.where(three, 3, 4)[:, None]
    corners = head.quads.astype(np.int32)
    ends = np.where(three, 2, 3)
    rows = np.arange(len(corners))
    corners[rows, ends] = -1 - corners[rows, ends]
    mesh.fill(
        {
            "GeometryVersion": 124,
            "Vertices": (CM * head.template.astype(np.float64)).ravel(),
            "PolygonVertexIndex": corners[kept],
        }
    )
    normals = vertex_normals(head.template, head.triangles).astype(np.float64)
    layers = {
        "LayerElementNormal": ("ByVertice", "Direct", {"Normals": normals.ravel()}),
        "LayerElementUV": (
            "ByPolygonVertex",
            "IndexToDirect",
            {"UV": head.uv.astype(np.float64).ravel(), "UVIndex": head.uv_quads[kept]},
        ),
        "LayerElementMaterial": (
            "ByPolygon",
            "IndexToDirect",
            {"Materials": _used(head)[1].astype(np.int32)},
        ),
    }
    for name, (mapping, reference, arrays) in layers.items():
        layer = mesh.add(name, 0)
        layer.fill({"Version": 101, "Name": "UVMap" if name.endswith("UV") else ""})
        layer.fill({"MappingInformationType": mapping, "ReferenceInformationType": reference})
        layer.fill(arrays)
    whole = mesh.add("Layer", 0)
    whole.add("Version", 100)
    for name in layers:
        whole.add("LayerElement").fill({"Type": name, "TypedIndex": 0})
    return number


def _used(head: HeadModel) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """The materials that have faces, and for each face which of these it has."""
    return np.unique(head.material, return_inverse=True)


def _materials(file: FbxFile, head: HeadModel, node: Long) -> None:
    colors = linear_colors(head)
    for index in _used(head)[0]:
        name = head.material_names[index]
        surface = head.surfaces.get(name, Surface())
        shown = colors[np.unique(head.quads[head.material == index])].mean(axis=0) * surface.tint
        color = material_picture(surface, "color", name)
        normal = material_picture(surface, "normal", name)
        number, record = file.add("Material", name, "Material", "")
        record.fill({"Version": 102, "ShadingModel": "phong", "MultiLayer": 0})
        plain = (1.0, 1.0, 1.0)
        record.settings(
            {
                "DiffuseColor": ("Color", "", "A", *(plain if color else shown.tolist())),
                "DiffuseFactor": ("Number", "", "A", 1.0),
                "SpecularColor": ("Color", "", "A", *plain),
                "SpecularFactor": ("Number", "", "A", REFLECTED),
                "ShininessExponent": ("Number", "", "A", _shininess(surface.roughness_factor)),
            }
        )
        file.join(number, node)
        if color:
            clear = surface.opacity != "opaque"
            texture = _texture(file, f"{name}_color", _coloured(color.data, shown, clear))
            file.join(texture, number, "DiffuseColor")
            if clear:
                file.join(texture, number, "TransparentColor")
        if normal:
            file.join(_texture(file, f"{name}_normal", normal.data), number, "NormalMap")


def _coloured(data: bytes, factor: NDArray[Any], clear: bool) -> bytes:
    """An image times a linear colour: where FBX has an image, programs pass over the colour."""
    from PIL import Image

    with Image.open(io.BytesIO(data)) as picture:
        return picture_bytes(tinted(picture.convert("RGBA" if clear else "RGB"), factor))


def _shininess(roughness: float) -> float:
    """The exponent of a highlight, as Blender's reader takes a roughness from it."""
    return float((10 * (1 - roughness)) ** 2)


def _texture(file: FbxFile, name: str, data: bytes) -> Long:
    """An image inside the file."""
    named = name + (".png" if data.startswith(b"\x89PNG") else ".jpg")
    video, record = file.add("Video", name, "Video", "Clip")
    record.fill({"Type": "Clip", "UseMipMap": 0, "Filename": named, "RelativeFilename": named})
    record.add("Content", data)
    texture, record = file.add("Texture", name, "Texture", "")
    record.fill({"Type": "TextureVideoClip", "Version": 202, "TextureName": name, "Media": name})
    record.settings({"UVSet": ("KString", "", "", "UVMap"), "UseMaterial": ("bool", "", "", 1)})
    record.fill({"FileName": named, "RelativeFilename": named, "Texture_Alpha_Source": "None"})
    file.join(video, texture)
    return texture


def _shapes(file: FbxFile, take: FbxTake, motion: Motion, shapes: Targets, mesh: Long) -> None:
    """A channel for each shape, and the curve of its weight."""
    if not shapes.names:
        return
    deformer, record = file.add("Deformer", FACE, "Deformer", "BlendShape")
    record.add("Version", 100)
    file.join(deformer, mesh)
    weights = CM * shapes.weights(motion).astype(np.float64)
    changes = shape_changes(motion.head, shapes.basis)
    for name, row, (rows, delta, turn) in zip(shapes.names, weights.T, changes, strict=True):
        channel, record = file.add("Deformer", name, "SubDeformer", "BlendShapeChannel")
        record.fill({"Version": 100, "DeformPercent": 0.0, "FullWeights": np.array([100.0])})
        record.settings({"DeformPercent": ("Number", "", "A", 0.0)})
        target, record = file.add("Geometry", name, "Geometry", "Shape")
        record.fill(
            {
                "Version": 100,
                "Indexes": rows.astype(np.int32),
                "Vertices": (CM * delta.astype(np.float64)).ravel(),
                "Normals": turn.astype(np.float64).ravel(),
            }
        )
        file.join(channel, deformer)
        file.join(target, channel)
        take.move(channel, "DeformPercent", {"DeformPercent": row})


def _joints(file: FbxFile, head: HeadModel) -> list[Long]:
    numbers: list[Long] = []
    for name, parent, place in zip(
        head.joint_names, head.joint_parents, joint_offsets(head), strict=True
    ):
        known = JOINTS.get(name, (name,))[0]
        numbers.append(_node(file, known, "LimbNode", place))
        bone, record = file.add("NodeAttribute", known, "NodeAttribute", "LimbNode")
        record.settings({"Size": 1.0})
        record.add("TypeFlags", "Skeleton")
        file.join(bone, numbers[-1])
        file.join(numbers[-1], numbers[parent] if parent >= 0 else 0)
    return numbers


def _skin(file: FbxFile, head: HeadModel, mesh: Long, node: Long, joints: list[Long]) -> None:
    """Each joint holds its vertices from where it rests."""
    if not joints:
        return
    skin, record = file.add("Deformer", FACE, "Deformer", "Skin")
    record.fill({"Version": 101, "Link_DeformAcuracy": 50.0, "SkinningType": "Linear"})
    file.join(skin, mesh)
    places = CM * head.joint_positions.astype(np.float64)
    for joint, number in enumerate(joints):
        rows = np.flatnonzero(head.skin_weights[:, joint])
        name = head.joint_names[joint]
        cluster, record = file.add("Deformer", name, "SubDeformer", "Cluster")
        record.add("Version", 100)
        record.add("UserData", "", "")
        if len(rows):
            weights = head.skin_weights[rows, joint].astype(np.float64)
            record.fill({"Indexes": rows.astype(np.int32), "Weights": weights})
        record.fill({"Transform": _shift(-places[joint]), "TransformLink": _shift(places[joint])})
        file.join(cluster, skin)
        file.join(number, cluster)
    _, pose = file.add("Pose", "bind", "Pose", "BindPose")
    pose.fill({"Type": "BindPose", "Version": 100, "NbPoseNodes": 1 + len(joints)})
    for number, place in zip([node, *joints], [np.zeros(3), *places], strict=True):
        pose.add("PoseNode").fill({"Node": number, "Matrix": _shift(place)})


def _shift(place: NDArray[Any]) -> NDArray[np.float64]:
    """(16,) a matrix whose last row is the shift."""
    matrix = np.eye(4)
    matrix[3, :3] = place
    return matrix.ravel()
