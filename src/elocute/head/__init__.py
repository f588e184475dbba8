"""The head: mesh, identities, expressions, joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.head.builtin import load_builtin_head
    from elocute.head.flame import FlameModel, flame_vertices, load_flame
    from elocute.head.flame_parameters import (
        FlameParameters,
        load_flame_parameters,
        save_flame_parameters,
    )
    from elocute.head.flame_solver import solve_flame
    from elocute.head.identity import (
        identity_names,
        resolve_identity,
        sample_identities,
        sample_identity,
        seeded_identities,
    )
    from elocute.head.mesh import head_from_arrays, read_mesh
    from elocute.head.model import HeadModel
    from elocute.head.registry import open_head
    from elocute.head.store import load_head, save_head

__all__ = [
    "FlameModel",
    "FlameParameters",
    "HeadModel",
    "flame_vertices",
    "head_from_arrays",
    "identity_names",
    "load_builtin_head",
    "load_flame",
    "load_flame_parameters",
    "load_head",
    "open_head",
    "read_mesh",
    "resolve_identity",
    "sample_identities",
    "sample_identity",
    "save_flame_parameters",
    "save_head",
    "seeded_identities",
    "solve_flame",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "builtin": ("load_builtin_head",),
        "flame": ("FlameModel", "flame_vertices", "load_flame"),
        "flame_parameters": (
            "FlameParameters",
            "load_flame_parameters",
            "save_flame_parameters",
        ),
        "flame_solver": ("solve_flame",),
        "identity": (
            "identity_names",
            "resolve_identity",
            "sample_identities",
            "sample_identity",
            "seeded_identities",
        ),
        "mesh": ("head_from_arrays", "read_mesh"),
        "model": ("HeadModel",),
        "registry": ("open_head",),
        "store": ("load_head", "save_head"),
    },
)
