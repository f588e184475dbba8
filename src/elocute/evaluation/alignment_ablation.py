"""Methods of alignment with and without each of their parts: what the parts are worth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from elocute.evaluation.alignment_scores import MethodVariant, method_variant

PLAIN = ("diagonal", "dtw", "softdtw", "ctw", "ctw/expected", "dctw", "dctw/expected")
PARTS: dict[str, Sequence[tuple[str, dict[str, Any]]]] = {
    "cca-soft": (
        ("no guide", {"guide": 0.0}),
        ("no prior", {"prior": 0.0}),
        ("no attention", {"sharpness": 0.0}),
        ("no guide, prior, attention", {"guide": 0.0, "prior": 0.0, "sharpness": 0.0}),
        ("cheapest path", {"softness": None}),
        ("no training", {"steps": 0}),
    ),
    "dcaw": (
        ("no training", {"steps": 0}),
        ("no folding", {"folds": 0, "fold_every": 10**6}),
        ("Eq. 2 alone", {"mutual": False}),
        ("attention fixed", {"attention": "fixed"}),
        ("attention sampled", {"attention": "sampled"}),
        ("attention DTW's path", {"attention": "path"}),
        ("attention diagonal", {"attention": "diagonal"}),
        ("attention uniform", {"attention": "uniform"}),
    ),
}


def ablation_variants(together: bool = False) -> list[MethodVariant]:
    """Features, CCA, and both learned methods with and without their parts, in this order.

    Of DCAW also what its features give by DTW, read without attention, and what is left where
    attention is off in training too: warped by the diagonal, read by DTW. together: learned methods
    are fitted once to all words.
    """
    way = "/together" if together else ""
    learned = {"ctw", "dctw"}
    found = [
        method_variant(n.replace("/", f"{way}/", 1) if "/" in n else n + way)
        if n.split("/")[0] in learned
        else method_variant(n)
        for n in PLAIN
    ]
    for method, parts in PARTS.items():
        found.append(method_variant(method + way))
        if method == "dcaw":
            found += [method_variant(f"dcaw{way}/features"), method_variant(f"dcaw{way}/expected")]
        for name, settings in parts:
            chosen = tuple(settings.items())
            found.append(MethodVariant(f"{method}: {name}", method, chosen, together))
        if method == "dcaw":
            off = (("attention", "diagonal"),)
            found.append(MethodVariant("dcaw: attention off", method, off, together, "features"))
    return found
