"""Sentences of our own, chosen so that together they hold as many pairs of phones as they can."""

# ruff: noqa: SIM905 - words read better as text
from __future__ import annotations

import itertools
import random
from collections import Counter
from collections.abc import Callable, Sequence

ADJECTIVES = (
    "big fresh puffy brown purple vague foamy shiny jolly thin smooth yellow awful quiet measured "
    "bumpy clever warm wooden fourth royal gray vivid rough huge cheap moist usual faithful orange "
    "noisy enough blue peaceful hollow thirsty awkward unique frozen velvet shabby muddy"
).split()
NOUNS = (
    "baker fisherman piano valley mouth bathroom shepherd garage bubble giraffe violin teacher "
    "pumpkin leaf elbow chef jury ship cathedral puppy village treasure spoon wolf bishop family "
    "thief moth boy camp museum voyage yacht waiter robot judge farmer vision cloth shrub poem "
    "bridge oyster whale thumb beach swamp envelope moon feather cow measure birch engine"
).split()
PLACES = (
    "beach farm museum bathroom village bridge harbour church office cave shop pub theatre "
    "zoo airport vineyard barn meadow pool hotel"
).split()
VERBS = (
    "bought improved watched shoved measured pushed enjoyed fetched wrapped moved found beat "
    "followed chewed borrowed mopped waved believed praised thanked judged heard polished vexed "
    "forgave combed hugged buried baffled probed washed voiced"
).split()
MOMENTS = (
    "before five",
    "every morning",
    "for months",
    "without a pause",
    "at dawn",
    "by mistake",
    "in February",
    "with pleasure",
    "after both showers",
    "rather awkwardly",
    "from above",
    "this Thursday",
    "while we were away",
    "beyond measure",
    "as usual",
    "for a joke",
)
PEOPLE = (
    "Ruth Bob Maya Joyce Phoebe Viv Walter Beth Georgia Thelma Hugo Pam Shawn Yara Boyd".split()
)
FORMS: tuple[str, ...] = (
    "The {a} {n} {v} a {b} {m} near the {p}, {t}.",
    "{w} {v} the {a} {n} and the {b} {m} {t}.",
    "Why would {w} have {v} my {a} {n} behind the {p}?",
    "Both {w} and {x} {v} every {a} {n} at the {p}.",
    "If you move the {a} {n}, the {b} {m} may fall off the {p}.",
    "{w} thought that our {n} {v} the {a} {m} {t}.",
    "Is this the {a} {n} which {w} {v} at the {p} {t}?",
    "Please give {w} five {a} photos of the {n} and one of the {m}.",
    "My {a} {n} never {v} the {b} {m} of the {p}.",
    "How much of the {n} was {a} when {w} {v} it {t}?",
)


def candidate(draw: random.Random) -> str:
    """One sentence of nine to fourteen words."""
    a, b = draw.sample(ADJECTIVES, 2)
    n, m = draw.sample(NOUNS, 2)
    w, x = draw.sample(PEOPLE, 2)
    return draw.choice(FORMS).format(
        a=a,
        b=b,
        n=n,
        m=m,
        w=w,
        x=x,
        v=draw.choice(VERBS),
        p=draw.choice(PLACES),
        t=draw.choice(MOMENTS),
    )


def phonetically_rich(
    count: int, phones_of: Callable[[str], Sequence[str]], seed: int, pool: int = 3000
) -> list[str]:
    """`count` different sentences, each the one that adds most to what is still rare.

    A pair of phones heard k times already is worth 1 / (1 + k), over the sentence's length.
    """
    draw = random.Random(seed)
    texts = list(dict.fromkeys(candidate(draw) for _ in range(pool)))
    pairs = {text: _pairs(phones_of(text)) for text in texts}
    heard: Counter[tuple[str, str]] = Counter()
    chosen: list[str] = []
    left = set(texts)
    for _ in range(count):
        best = max(sorted(left), key=lambda t: _worth(pairs[t], heard))
        chosen.append(best)
        left.discard(best)
        heard.update(pairs[best])
    return chosen


def _pairs(phones: Sequence[str]) -> list[tuple[str, str]]:
    return list(itertools.pairwise(phones))


def _worth(pairs: list[tuple[str, str]], heard: Counter[tuple[str, str]]) -> float:
    return sum(1 / (1 + heard[pair]) for pair in set(pairs)) / (len(pairs) + 6)
