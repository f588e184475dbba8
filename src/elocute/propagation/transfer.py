"""From a path to parameters: how motion of one recording is laid over another (section 4.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.errors import AlignmentError

Array = NDArray[np.float32]


def carried(values: Array, path: NDArray[np.intp], targets: int) -> Array:
    """(target frame, n) of values (source frame, n) along a path (step, 2), whole against whole.

    The mean where many source frames meet one target frame; a copy where one source frame meets
    many. Raises AlignmentError for a path that leaves a target frame without a source, or one
    beyond the values.
    """
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise AlignmentError.about("path", found=f"shape {path.shape}", allowed="(step, 2)")
    source, target = path[:, 0], path[:, 1]
    if path.min() < 0 or source.max() >= len(values) or target.max() >= targets:
        raise AlignmentError.about(
            "path",
            found=f"up to frames {source.max()}, {target.max()}",
            allowed=f"below {len(values)}, {targets}",
        )
    counts = np.bincount(target, minlength=targets)
    if not counts.all():
        raise AlignmentError.about(
            "path",
            found=f"no source for target frame {int(counts.argmin())}",
            allowed="one or more for every frame",
        )
    sums = np.zeros((targets, values.shape[1]))
    np.add.at(sums, target, values[source])
    return (sums / counts[:, None]).astype(np.float32)
