"""Parameters of one recording transferred to another along a warping path (section 4.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.errors import AlignmentError


def transfer_parameters(values: Float32Array, path: NDArray[np.intp], targets: int) -> Float32Array:
    """Parameters of the target: the mean over many-to-one, a copy over one-to-many.

    Parameters
    ----------
    values
        (source frame, parameter).
    path
        (step, 2) source and target frames that belong together.
    targets
        Number of target frames.

    Returns
    -------
    ndarray
        (target frame, parameter).

    Raises
    ------
    AlignmentError
        For a path that leaves a target frame without a source, or reaches beyond the values.

    References
    ----------
    Tzirakis et al. 2019, section 4.2.
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
