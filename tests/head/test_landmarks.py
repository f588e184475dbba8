"""The 68 landmarks are where iBUG's scheme has them: by the face's profile, and by others."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.head.builtin import load_builtin_head
from elocute.numerics.rigid_alignment import similarity_between
from recipes.heads_speak import ict_parts

HELD = [27, 31, 35, 36, 39, 42, 45, 48, 54, 57]
"""Corners of eyes and mouth, root and wings of the nose, the lower lip: two faces laid over each
other."""


def test_the_nose_is_marked_along_its_profile():
    head = load_builtin_head()
    places = 1000 * head.template[head.landmarks].astype(float)
    bridge, tip, base, lip = places[27], places[30], places[33], places[51]
    skin = head.regions["skin"]
    line = 1000 * head.template[skin[np.abs(head.template[skin, 0]) < 5e-4]].astype(float)
    between = line[(line[:, 1] < bridge[1]) & (line[:, 1] > lip[1])]
    assert tip[2] == pytest.approx(between[:, 2].max(), abs=0.1)  # what stands out most
    # The base is where the profile turns from the nose to the lip: furthest behind their chord.
    below = between[(between[:, 1] < tip[1]) & (between[:, 2] > lip[2] - 8)]
    along = (lip - tip)[1:] / np.linalg.norm((lip - tip)[1:])
    behind = (below - tip)[:, 1:] @ [along[1], -along[0]]
    corner = below[np.argmax(np.abs(behind))]
    assert np.linalg.norm(base - corner) < 4
    for row in (28, 29):  # steps of one length along the bridge
        share = (bridge[1] - places[row, 1]) / (bridge[1] - tip[1])
        assert share == pytest.approx((row - 27) / 3, abs=0.05)


def test_left_mirrors_right():
    head = load_builtin_head()
    pairs = [(0, 16), (17, 26), (19, 24), (31, 35), (32, 34), (36, 45), (48, 54), (50, 52)]
    pairs += [(49, 53), (55, 59), (56, 58), (60, 64), (61, 63), (65, 67)]
    for one, other in pairs:
        places = head.template[head.landmarks[[one, other]]]
        assert np.abs(places[0] * [-1, 1, 1] - places[1]).max() < 2e-3


@pytest.mark.shared_data
def test_others_put_them_in_the_same_places(shared_data):
    """ICT-FaceKit's neutral head, marked by its authors; the noses are of two faces."""
    points, _, marks = ict_parts(shared_data / "ict_facekit" / "FaceXModel")
    theirs = 0.01 * points[marks]
    head = load_builtin_head()
    ours = head.template[head.landmarks].astype(float)
    laid = similarity_between(ours[HELD], theirs[HELD], np.ones(len(HELD)))(ours)
    off = 1000 * np.linalg.norm(laid - theirs, axis=1)
    assert off[31:36].max() < 4.5 and off[36:48].max() < 4 and off[48:].max() < 4.5
    assert off[27:].mean() < 2.7
