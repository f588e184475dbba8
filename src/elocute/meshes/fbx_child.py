"""Reads an FBX file with Blender in a subprocess, and writes a .glb.

Arguments: the file to read, the file to write.
"""

from __future__ import annotations

import sys

MEMORY_MAX_BYTES = 8_000_000_000


def main() -> None:
    """Read the first file, write the second."""
    import bpy  # pyright: ignore[reportMissingImports]

    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_MAX_BYTES, MEMORY_MAX_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    source, target = sys.argv[1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    read = getattr(bpy.ops.wm, "fbx_import", None) if bpy.app.version >= (4, 5) else None
    if read is not None:
        read(filepath=source)
    else:
        bpy.ops.import_scene.fbx(filepath=source, use_image_search=False)
    # What a file only names is not there; the writer would look for it.
    for image in [each for each in bpy.data.images if each.packed_file is None]:
        bpy.data.images.remove(image)
    bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_force_sampling=False)


if __name__ == "__main__":
    main()
