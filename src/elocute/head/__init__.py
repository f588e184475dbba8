"""The head: mesh, identities, expressions, joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.head.builtin import load_builtin_head as load_builtin_head
    from elocute.head.flame import (
        FlameModel as FlameModel,
        flame_vertices as flame_vertices,
        load_flame as load_flame,
    )
    from elocute.head.flame_parameters import (
        FlameParameters as FlameParameters,
        load_flame_parameters as load_flame_parameters,
        save_flame_parameters as save_flame_parameters,
    )
    from elocute.head.flame_solver import solve_flame as solve_flame
    from elocute.head.identity import (
        identity_names as identity_names,
        resolve_identity as resolve_identity,
        sample_identities as sample_identities,
        sample_identity as sample_identity,
        seeded_identities as seeded_identities,
    )
    from elocute.head.mesh import head_from_arrays as head_from_arrays, read_mesh as read_mesh
    from elocute.head.model import HeadModel as HeadModel
    from elocute.head.registry import open_head as open_head
    from elocute.head.store import load_head as load_head, save_head as save_head

__getattr__, __dir__ = lazy(__name__, __file__)
