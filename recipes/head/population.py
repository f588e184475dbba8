"""Faces that MakeHuman's targets can make: an average adult and random ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.head.makehuman import MakeHuman

RACES = ("african", "asian", "caucasian")
FOLDERS = (
    "head",
    "forehead",
    "eyebrows",
    "eyes",
    "nose",
    "mouth",
    "chin",
    "cheek",
    "ears",
    "neck",
)
OPPOSITES = (
    ("decr", "incr"),
    ("down", "up"),
    ("in", "out"),
    ("backward", "forward"),
    ("concave", "convex"),
    ("compress", "uncompress"),
)
SPREAD = {
    "mouth": 0.24,
    "nose": 0.26,
    "eyes": 0.21,
    "chin": 0.26,
    "cheek": 0.26,
    "ears": 0.26,
    "forehead": 0.20,
    "eyebrows": 0.28,
    "head": 0.13,
    "neck": 0.15,
}
"""Standard deviation of a detail control, of its full range, by face part."""
OUTLINES = ("oval", "round", "rectangular", "square", "triangular", "invertedtriangular", "diamond")
ASYMMETRIES = ("jaw-1", "mouth-1", "nose-1", "eye-1", "cheek-1", "brown-1")


YEARS_AT_HALF, YEARS_PER_AGE = 25, 130
"""MakeHuman's age: 0.5 is 25 years, 1 is 90."""


@dataclass(frozen=True)
class Traits:
    """Each share 0..1; `races` as RACES and sums to one."""

    male: float = 0.5
    age: float = 0.5  # 0.5 = 25 years, 1 = 90 years
    muscle: float = 0.5
    weight: float = 0.5
    races: tuple[float, float, float] = (0.33, 0.33, 0.34)

    @property
    def years(self) -> float:
        return YEARS_AT_HALF + YEARS_PER_AGE * (self.age - 0.5)


def body(mh: MakeHuman, traits: Traits) -> np.ndarray:
    """(vertex, 3) displacement of the base mesh for broad traits."""
    old = max(0.0, traits.age * 2 - 1)
    muscles = _three_way("muscle", traits.muscle)
    weights = _three_way("weight", traits.weight)
    moved = np.zeros_like(mh.base.vertices)
    for sex, sex_share in (("male", traits.male), ("female", 1 - traits.male)):
        for age, age_share in (("young", 1 - old), ("old", old)):
            share = sex_share * age_share
            if not share:
                continue
            for race, race_share in zip(RACES, traits.races, strict=True):
                moved += share * race_share * mh.target(f"macrodetails/{race}-{sex}-{age}")
            for muscle, a in muscles.items():
                for weight, b in weights.items():
                    if a * b:
                        name = f"macrodetails/universal-{sex}-{age}-{muscle}-{weight}"
                        moved += share * a * b * mh.target(name)
    return moved


def _three_way(kind: str, value: float) -> dict[str, float]:
    low, high = max(0.0, 1 - value * 2), max(0.0, value * 2 - 1)
    return {f"min{kind}": low, f"average{kind}": 1 - low - high, f"max{kind}": high}


def detail_controls(mh: MakeHuman) -> dict[tuple[str, str], list[tuple[str, str]]]:
    """Two-ended controls, left and right joined: (folder, name) -> [(low, high) targets]."""
    controls: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for folder in FOLDERS:
        names = set(mh.target_names(folder))
        for name in sorted(names):
            for low, high in OPPOSITES:
                if not name.endswith(f"-{low}"):
                    continue
                partner = name[: -len(low)] + high
                if partner in names and not _moves_whole_part(folder, name):
                    bare = name[2:] if name[:2] in ("l-", "r-") else name
                    pair = (f"{folder}/{name}", f"{folder}/{partner}")
                    controls.setdefault((folder, bare), []).append(pair)
    return controls


def _moves_whole_part(folder: str, name: str) -> bool:
    """Sideways shifts of middle parts are asymmetries; head shifts are no shape at all."""
    if name.startswith(("head-trans", "neck-trans", "head-age")):
        return True
    return "trans-in" in name and folder in ("head", "nose", "mouth", "neck")


TONES = (0.92, 0.34, 0.18)
"""Skin tone of each ancestry's average, 0 light … 1 dark; individuals vary around it."""


def tone_of(traits: Traits) -> float:
    return float(np.dot(traits.races, TONES))


def random_adult(
    mh: MakeHuman, rng: np.random.Generator, detail: float = 1.0
) -> tuple[np.ndarray, Traits]:
    """(vertex, 3) m: one sampled adult over the whole base mesh, and its traits."""
    races = rng.dirichlet([0.8, 0.8, 0.8])
    traits = Traits(
        male=rng.beta(0.45, 0.45),
        age=0.5 + 0.38 * rng.beta(1.1, 2.2),
        muscle=float(np.clip(rng.normal(0.5, 0.16), 0.1, 0.95)),
        weight=float(np.clip(rng.normal(0.5, 0.17), 0.1, 0.95)),
        races=(races[0], races[1], races[2]),
    )
    moved = body(mh, traits)
    for (folder, _), pairs in detail_controls_of(mh).items():
        amount = float(np.clip(rng.normal(0, SPREAD[folder]), -0.85, 0.85)) * detail
        for low, high in pairs:
            moved += abs(amount) * mh.target(low if amount < 0 else high)
    moved += rng.uniform(0, 0.35) * detail * mh.target(f"head/head-{rng.choice(OUTLINES)}")
    if rng.random() < 0.5:
        for name in ASYMMETRIES:
            side = rng.choice(["l", "r"])
            moved += rng.uniform(0, 0.2) * detail * mh.target(f"asym/asym-{name}-{side}")
    return mh.base.vertices + moved, traits


_controls: dict[int, dict] = {}


def detail_controls_of(mh: MakeHuman) -> dict[tuple[str, str], list[tuple[str, str]]]:
    """`detail_controls`, listed once per data folder."""
    if id(mh) not in _controls:
        _controls[id(mh)] = detail_controls(mh)
    return _controls[id(mh)]
