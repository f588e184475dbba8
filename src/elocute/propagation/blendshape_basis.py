"""The basis whose parameters are transferred: given, learned, or left by an earlier run."""

from __future__ import annotations

from pathlib import Path

from elocute.capture.blendshapes.basis_motion import sweep_shapes
from elocute.capture.blendshapes.blendshape_learning import learn_blendshapes
from elocute.corpus.corpus_store import Corpus
from elocute.corpus.shards import BASIS
from elocute.errors import CorpusError
from elocute.motion.store import load_motion, save_motion
from elocute.propagation.captured_words import CapturedCorpus


def provide_basis(
    corpus: Corpus, folder: Path, given: Path | None = None, split: str = "default"
) -> Path:
    """Speech blendshapes as they lie in the output folder of a propagation.

    Parameters
    ----------
    corpus
        Clips of captured speakers.
    folder
        The output folder; a basis that an earlier run left there is kept unless one is given.
    given
        A basis (.npz) to copy; by default one is learned from the training clips.
    split
        Name of the split whose training clips are learned from; all clips where the corpus lacks
        it.

    Returns
    -------
    Path
        Of the basis, absolute.

    Raises
    ------
    CorpusError
        Where the basis is of another mesh, or the split has no training clip.

    References
    ----------
    Tzirakis et al. 2019, section 3.3.
    """
    path = (folder / BASIS).resolve()
    if given is not None:
        motion = load_motion(given)
        CapturedCorpus(corpus, motion)  # refuses another mesh
        save_motion(motion, path)
    elif not path.is_file():
        names = corpus.split(split).train if split in corpus.splits else tuple(corpus.by_name)
        if not names:
            raise CorpusError.about(corpus.folder, found=f"no clip in train of split {split}")
        save_motion(sweep_shapes(learn_blendshapes(corpus, names).head), path)
    return path
