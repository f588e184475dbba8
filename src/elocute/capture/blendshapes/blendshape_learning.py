"""From a corpus to a head whose shapes are those of its speech, and the motion that shows them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.capture.blendshapes.components import (
    PrincipalComponents,
    localise_components,
    principal_directions,
)
from elocute.capture.blendshapes.settings import COMPONENTS, COMPONENTS_MAX, BlendshapeConfig
from elocute.corpus.corpus_statistics import displacement_blocks
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.head.builtin import load_builtin_head
from elocute.head.looks.people import PEOPLE
from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.one_line_repr import one_line


@dataclass(frozen=True, eq=False)
class Blendshapes:
    """A learned basis.

    Attributes
    ----------
    head
        Shapes `speech00`, `speech01`, …: a weight of 1 is one standard deviation, (vertex, 3) m.
    explained
        (component,) share of the squared displacement explained by the shapes so far.
    frames
        How many meshes it was learned from.
    """

    head: HeadModel
    explained: NDArray[np.float64]
    frames: int

    __repr__ = one_line


def learn_blendshapes(
    corpus: Corpus,
    names: Sequence[str],
    config: BlendshapeConfig | None = None,
    progress: object = None,
) -> Blendshapes:
    """Learn a basis from clips: every mesh minus its speaker's neutral face, then components.

    Signs are fixed so that each component lowers what it moves most or, where that is a movement in
    depth or to the side, moves it forward or to the left.

    Parameters
    ----------
    corpus
        With clips of one topology.
    names
        Of the clips to learn from.
    config
        How many shapes and of what kind; the paper's by default.
    progress
        Called with the share of the frames that are done, 0 to 1.

    Raises
    ------
    CorpusError
        Where nothing moves, or the corpus does not say how vertices are joined.

    References
    ----------
    "Speech in the wild" (2019), section 3.3.
    """
    config = config or BlendshapeConfig()
    wanted = config.count or COMPONENTS_MAX
    blocks = _with_progress(
        displacement_blocks(corpus, names), sum(corpus.entry(n).frames for n in names), progress
    )
    principal = principal_directions(blocks, max(wanted, COMPONENTS))
    if not len(principal.strengths):
        raise CorpusError.about(corpus.folder, found="nothing moves", allowed="clips of speech")
    count = _count(principal, config)
    if config.sparsity:
        shapes, deviations = localise_components(principal, count, config.sparsity)
    else:
        shapes, deviations = principal.directions[:count], principal.deviations[:count]
    basis = _signed(shapes) * np.asarray(deviations, np.float32)[:, None]
    return Blendshapes(
        _head_with_basis(corpus, basis.reshape(len(basis), -1, 3)),
        _explained(principal, shapes),
        principal.frames,
    )


def _count(principal: PrincipalComponents, config: BlendshapeConfig) -> int:
    if config.count is not None:
        return min(config.count, len(principal.strengths))
    enough = np.flatnonzero(principal.explained >= (config.variance or 1.0) - 1e-9)
    return int(enough[0]) + 1 if len(enough) else len(principal.strengths)


def _explained(principal: PrincipalComponents, shapes: Float32Array) -> NDArray[np.float64]:
    """(component,) share of the energy in the span of the first one, two, … shapes."""
    basis, _ = np.linalg.qr(shapes.T.astype(np.float64))
    inside = (principal.directions.astype(np.float64) * principal.strengths[:, None]) @ basis
    return np.cumsum(np.square(inside).sum(axis=0)) / max(principal.energy, 1e-300)


def _signed(shapes: Float32Array) -> Float32Array:
    """(component, number): the coordinate that moves most goes down, forward or to the left."""
    most = np.abs(shapes).argmax(axis=1)
    values = shapes[np.arange(len(shapes)), most]
    wanted = np.where(most % 3 == 1, -1, 1)
    return shapes * (np.sign(values) * wanted).astype(np.float32)[:, None]


def _head_with_basis(corpus: Corpus, basis: Float32Array) -> HeadModel:
    """The corpus's head with other shapes; the built-in one where its mesh is the corpus's."""
    names = tuple(f"speech{index:02d}" for index in range(len(basis)))
    builtin = load_builtin_head()
    if corpus.topology == builtin.name and corpus.vertex_count == builtin.vertex_count:
        mean = np.mean([corpus.template(s) for s in corpus.subjects], axis=0)
        return replace(
            builtin.with_identity(np.zeros(0, np.float32)),
            template=mean.astype(np.float32),
            expression_names=names,
            expression_basis=basis,
            look=PEOPLE["mean"],
        )
    if corpus.faces is None:
        raise CorpusError.about(
            corpus.folder, found="no faces", allowed="a corpus that says how vertices are joined"
        )
    template = np.mean([corpus.template(s) for s in corpus.subjects], axis=0)
    return head_from_arrays(
        corpus.topology or "captured",
        template,
        np.asarray(corpus.faces),
        expression_names=names,
        expression_basis=basis,
        notice=corpus.note,
    )


def _with_progress(
    blocks: Iterable[NDArray[np.floating]], frames: int, progress: object
) -> Iterator[NDArray[np.floating]]:
    done = 0
    for block in blocks:
        yield block
        done += len(block)
        if callable(progress):
            progress(done / max(frames, 1))


REACH = 2.0  # deviations to both sides
SHAPE_S = 1.0  # one period of a shape
FPS = 30.0


def sweep_shapes(head: HeadModel) -> Motion:
    """Each shape from 0 to +2, to -2 and back, one after another; weights are deviations."""
    frames = round(SHAPE_S * FPS)
    wave = REACH * np.sin(np.linspace(0, 2 * np.pi, frames, endpoint=False))
    weights = np.kron(np.eye(len(head.expression_names)), wave[:, None])
    return Motion(head, weights.astype(np.float32), FPS)


def extreme_shapes(motion: Motion) -> list[tuple[str, Motion]]:
    """Labels and single frames: every shape at +2 and -2 deviations, for a contact sheet."""
    head = motion.head
    labelled = []
    for index, name in enumerate(head.expression_names):
        for value in (REACH, -REACH):
            weights = np.zeros((1, len(head.expression_names)), np.float32)
            weights[0, index] = value
            labelled.append((f"{name} {value:+.0f}", Motion(head, weights, FPS)))
    return labelled
