"""Write into the shipped `voca` how it errs in the styles that it learned.

    python -m recipes.voca_errors build/corpus

`elocute style fit` weighs distances by these errors; `train_default` writes them after a training.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from elocute.corpus.corpus_store import open_corpus
from elocute.training.voca.run import record_style_errors
from recipes.train_default import ASSET


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("corpus", type=Path)
    choice = parser.parse_args()
    record_style_errors(ASSET, open_corpus(choice.corpus))
    print(ASSET, f"{ASSET.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
