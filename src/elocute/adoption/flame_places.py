"""Where the 68 landmarks lie on FLAME's mesh of 5023 vertices."""

FLAME_VERTICES = 5023
# fmt: off
FLAME_LANDMARKS = (
    2212, 3060, 3485, 3384, 3386, 3389, 3418, 3395, 3414, 3598, 3637, 3587, 3582, 3580, 3756, 2012,
    730, 1984, 3157, 335, 3705, 3684, 3851, 3863, 16, 2138, 571,
    3553, 3561, 3501, 3526, 2748, 2792, 3556, 1675, 1612,
    2437, 2383, 2494, 3632, 2278, 2296, 3833, 1343, 1034, 1175, 884, 829,
    2715, 2813, 2774, 3543, 1657, 1696, 1579, 1795, 1865, 3503, 2948, 2898,
    2845, 2785, 3533, 1668, 1730, 1669, 3509, 2786,
)
# fmt: on
"""In iBUG's order (the jaw line, the brows, the nose, the eyes, the lips), as published with NPHM
(Giebenhain et al. 2023); docs/cards/vertex_lists.md says where."""
