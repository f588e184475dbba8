"""Pictures of a shirt: weave, ribs, seams and folds, drawn in space so that none is stretched.

Every texel knows where on the neutral body it lies. Heights are metres, and slopes are true.
"""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndimage
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.spatial import KDTree

from elocute.numerics.smoothing import smoothstep
from recipes.looks import collars
from recipes.looks.canvas import resized
from recipes.looks.clothes import Shirt
from recipes.looks.surface import unit

SIZE, COARSE = 1024, 512
"""Pixels of a picture, and of the grid on which places are found."""
CELLS = 48
"""Of the block of noise that is repeated through space."""
PLAIN = 0.90
"""Brightness of even cloth; the margin on the right, where buttons lie, has all of it."""
FRONT_M = -0.075
"""Cloth further back from the eyes than this is the back's."""
RIBS, RIB_M, RIB_SHADE = 112, 0.00045, 0.13
"""Round a knitted band; how deep their grooves are, how dark."""
GRAIN_M, GRAIN_SHADE = {True: (0.0015, 0.00012), False: (0.0010, 0.00006)}, 0.012
"""Size and height of a knit's stitches and of a weave's threads."""
SEAM_M, SEAM_SHADE = 0.0008, 0.16
SEAM_TURN, SEAM_ENDS = 0.24, 0.80
"""Shoulder seams: turns from the back, and where they end of the way down to the hem."""
STITCH_IN_M, STITCH_WIDE_M, STITCH_LONG_M, STITCH_SHADE = 0.005, 0.0005, 0.0032, 0.13
PLACKET_M, PLACKET_HIGH_M = 0.016, 0.0011
"""Half the width of the strip that buttons sit on, and how far it stands out."""
FRONT_CREASES = (
    ((168, -300), (120, -262), (66, -212), 9.0, 4.2),
    ((172, -282), (142, -236), (102, -186), 8.0, 3.6),
    ((160, -325), (110, -292), (38, -272), 10.0, 4.0),
    ((176, -212), (140, -204), (98, -208), 7.0, 2.2),
    ((86, -172), (64, -212), (60, -262), 11.0, 2.4),
    ((30, -190), (12, -228), (16, -282), 12.0, 1.8),
)
BACK_CREASES = (
    ((166, -292), (122, -246), (84, -196), 9.0, 4.2),
    ((156, -316), (108, -276), (40, -256), 10.0, 4.0),
    ((170, -262), (140, -214), (112, -168), 8.0, 3.0),
    ((52, -148), (20, -160), (-28, -154), 8.0, 2.2),
    ((60, -190), (46, -238), (54, -300), 12.0, 2.2),
)
"""Folds of the left side: three points of a curve, mm from the middle and from the eyes' height,
half its width and its height; those of the right side are not quite the same."""
RIGHT_MOVED_MM, RIGHT_LOWER, CREASED, CREASE_POINTS = (5.0, -9.0), 0.8, 1.6, 160
FOLD_SHADE = 16.0
"""How much darker a hollow is, per metre."""


def pictures(shirt: Shirt) -> tuple[np.ndarray, np.ndarray]:
    """(SIZE, SIZE, 3) grey brightness and normals of the cloth, both 0..1."""
    cloth = _Cloth(shirt)
    wide, high = GRAIN_M[shirt.cut.knitted]
    grain = _solid(11, cloth.places, wide)
    height, shade = high * grain, GRAIN_SHADE * grain
    for part in (_ribs, _seams, _leaf_stitches, _placket, _folds):
        rise, dark = part(cloth)
        height, shade = height + rise, shade - dark
    grey = PLAIN + shade
    normal = _normals(height, cloth.texel_m)
    grey[:, cloth.margin], normal[:, cloth.margin] = 1.0, (0.5, 0.5, 1.0)
    return np.repeat(grey.clip(0, 1)[..., None], 3, 2), normal


class _Cloth:
    """Where each texel of a shirt lies."""

    def __init__(self, shirt: Shirt) -> None:
        cards, self.cut, self.shirt = shirt.cards, shirt.cut, shirt
        worn = cards.uv_quads[: len(cards.uv_quads) - shirt.button_faces]
        corners, first = np.unique(worn.ravel(), return_index=True)
        points = cards.points[cards.quads.ravel()[first]]
        texel = cards.uv[corners] * [1, -1] + [0, 1]
        at = (np.arange(COARSE) + 0.5) / COARSE
        x, y = np.meshgrid(at, at)
        grid = LinearNDInterpolator(texel, points)(x, y)
        hole = np.isnan(grid[..., 0])
        grid[hole] = NearestNDInterpolator(texel, points)(x[hole], y[hole])
        self.places = np.stack([resized(grid[..., k], SIZE) for k in range(3)], -1)
        """(SIZE, SIZE, 3) m, from the eyes."""
        self.places -= [0, shirt.eye_m[1], shirt.eye_m[2]]
        steps = [np.linalg.norm(np.gradient(self.places, axis=k), axis=-1) for k in (0, 1)]
        ring = cards.quads.ravel()[first] // shirt.columns
        at_edge = texel[ring == 4 + collars.EDGE_RING, 1]
        self.leaf_ends = float(at_edge.max()) if not self.cut.knitted else 0.0
        """Down the picture, where the outer side of a collar ends."""
        self.texel_m = np.clip(np.minimum(*steps), 1e-4, None)
        """(SIZE, SIZE) the shorter side of a texel."""
        self.down = np.repeat(((np.arange(SIZE) + 0.5) / SIZE)[:, None], SIZE, 1)
        self.turn = np.repeat((((np.arange(SIZE) + 0.5) / SIZE - 0.02) / 0.94)[None], SIZE, 0)
        self.below = (self.down - self.cut.band_share) / (1 - self.cut.band_share)
        self.margin = slice(int(0.978 * SIZE), SIZE)

    def beyond(self, share: float, soft: float = 0.01) -> np.ndarray:
        """0 on the band, 1 on the cloth from a share of the way to the hem."""
        return smoothstep(np.clip((self.below - share) / soft, 0, 1))


def _normals(height: np.ndarray, texel_m: np.ndarray) -> np.ndarray:
    """(SIZE, SIZE, 3) 0..1: what the renderer scales by the shorter side of a texel."""
    across, along = np.gradient(height, axis=1), np.gradient(height, axis=0)
    slope = np.stack([-across / texel_m, along / texel_m, np.ones_like(height)], -1)
    slope[..., :2] = slope[..., :2].clip(-1.2, 1.2)
    return unit(slope) * 0.5 + 0.5


def _solid(seed: int, places: np.ndarray, size_m: float) -> np.ndarray:
    """Noise in space of mean 0 and deviation 1, in lumps of a size, at places (..., k), m."""
    count = places.shape[-1]
    block = np.random.default_rng(seed).normal(size=(CELLS,) * count)
    block = ndimage.gaussian_filter(block, 0.5, mode="wrap")
    at = np.moveaxis(places / size_m % CELLS, -1, 0)
    return ndimage.map_coordinates(block / block.std(), at, order=1, mode="grid-wrap")


def _line(away: np.ndarray, wide: float) -> np.ndarray:
    return np.exp(-((away / wide) ** 2))


def _ribs(cloth: _Cloth) -> tuple[np.ndarray, np.ndarray]:
    """Upright ribs all round a knitted band."""
    if not cloth.cut.knitted:
        return 0 * cloth.down, 0 * cloth.down
    band = 1 - cloth.beyond(-0.012, 0.006)
    groove = 0.5 - 0.5 * np.cos(2 * np.pi * RIBS * cloth.turn)
    return -RIB_M * band * groove**2, RIB_SHADE * band * groove**2


def _seams(cloth: _Cloth) -> tuple[np.ndarray, np.ndarray]:
    """Where the band is sewn on, and over each shoulder a little before its ridge."""
    seam = np.zeros_like(cloth.turn)
    for place in (0.5 - SEAM_TURN, 0.5 + SEAM_TURN):
        seam += _line(cloth.turn - place, 0.0014)
    seam *= cloth.beyond(0.0) * (1 - cloth.beyond(SEAM_ENDS - 0.15, 0.15))
    round_ = _line(cloth.below - 0.004, 0.006) * cloth.cut.knitted
    both = np.maximum(0.7 * seam, round_)
    return -SEAM_M * both, SEAM_SHADE * both


def _stitches(cloth: _Cloth, away: np.ndarray, run: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A row of stitches where `away` (m) is 0; `run` counts metres along it."""
    dash = smoothstep(np.clip(2.2 * np.abs((run / STITCH_LONG_M) % 1 - 0.5), 0, 1))
    row = _line(away, STITCH_WIDE_M)
    return -0.0006 * row * (1 - 0.8 * dash), STITCH_SHADE * row * (1 - 0.6 * dash)


def _leaf_stitches(cloth: _Cloth) -> tuple[np.ndarray, np.ndarray]:
    """Along the edge of a collar's leaf."""
    if cloth.cut.knitted:
        return 0 * cloth.down, 0 * cloth.down
    columns, ring = cloth.shirt.columns, 4 + collars.EDGE_RING
    edge = cloth.shirt.cards.points[ring * columns : (ring + 1) * columns]
    edge = edge - [0, *cloth.shirt.eye_m[1:]]
    fine = np.asarray(ndimage.zoom(np.vstack([edge, edge[:1]]), (12, 1), order=1))
    run = np.r_[0, np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))]
    rows = cloth.down < cloth.leaf_ends
    away, nearest = KDTree(fine).query(cloth.places[rows])
    rise, dark = np.zeros_like(cloth.down), np.zeros_like(cloth.down)
    rise[rows], dark[rows] = _stitches(cloth, away - STITCH_IN_M, run[nearest])
    return rise, dark


def _placket(cloth: _Cloth) -> tuple[np.ndarray, np.ndarray]:
    """The strip down the front of a shirt, sewn down along both its sides."""
    if cloth.cut.knitted:
        return 0 * cloth.down, 0 * cloth.down
    front = (cloth.places[..., 2] > FRONT_M) * cloth.beyond(-0.01)
    aside = np.abs(cloth.places[..., 0])
    edge = np.clip((PLACKET_M - aside) / 0.0016, 0, 1)
    rise, dark = _stitches(cloth, aside - (PLACKET_M - STITCH_IN_M), cloth.places[..., 1])
    rise = rise + PLACKET_HIGH_M * smoothstep(edge)
    dark = dark + 0.14 * _line(aside - PLACKET_M - 0.0006, 0.0010)
    return front * rise, front * dark


def _folds(cloth: _Cloth) -> tuple[np.ndarray, np.ndarray]:
    """Folds that spread from the armpits, and a soft drape below the shoulders."""
    coarse = cloth.places[:: SIZE // COARSE, :: SIZE // COARSE]
    front = coarse[..., 2] > FRONT_M
    rise = np.zeros(coarse.shape[:2])
    for creases, side in ((FRONT_CREASES, front), (BACK_CREASES, ~front)):
        for *curve, wide, high in creases:
            bent = np.array(curve)
            rise[side] += _crease(bent, wide, high, coarse[side][:, :2])
            bent = (bent + RIGHT_MOVED_MM) * [-1, 1]
            rise[side] += _crease(bent, wide, RIGHT_LOWER * high, coarse[side][:, :2])
    rise = resized(ndimage.gaussian_filter(rise, 1.0), SIZE) * cloth.beyond(0.0, 0.15)
    return rise, -FOLD_SHADE * np.minimum(rise, 0)


def _crease(bent_mm: np.ndarray, wide_mm: float, high_mm: float, places: np.ndarray) -> np.ndarray:
    """(n,) m: a ridge along a curve with a hollow on one side, fading towards both ends."""
    share = np.linspace(0, 1, CREASE_POINTS)[:, None]
    a, b, c = bent_mm / 1000
    curve = (1 - share) ** 2 * a + 2 * share * (1 - share) * b + share**2 * c
    ahead = unit(np.gradient(curve, axis=0))
    away, nearest = KDTree(curve).query(places)
    off = places - curve[nearest]
    aside = np.sign(ahead[nearest, 0] * off[:, 1] - ahead[nearest, 1] * off[:, 0]) * away
    wide = wide_mm / 1000 * (0.7 + 0.6 * share[nearest, 0])
    fade = CREASED * np.sin(np.pi * np.clip(0.18 + 0.82 * share[nearest, 0], 0, 1)) ** 1.5
    ridge = _line(aside, wide) - 0.7 * _line(aside - 1.5 * wide, wide)
    return high_mm / 1000 * fade * ridge
