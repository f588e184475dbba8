"""Faces of flesh: they move as no rig does, and still as a face may."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.articulation.style import STYLES
from elocute.capture import Scanner
from elocute.capture.simulation.scan_simulator import ScanSimulator
from elocute.errors import CaptureError
from elocute.head import load_builtin_head
from elocute.speech.text.known_phones import posteriors_from_phones
from recipes.rich_faces.flesh import lagging
from recipes.rich_faces.own_shapes import own_versions
from recipes.rich_faces.rich_face import FaceRichness, RichFace, take_from_sound
from tests.head.test_lips import crowns, deepest_mm, gap_mm

SAID = "P AA B IY M AE T F OW P SIL V EH SH UW CH M AY B W AO M S R IY P"
FPS, RATE = 30.0, 100.0


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


@pytest.fixture(scope="module")
def phones():
    """Long vowels, short consonants, a pause that is long enough to swallow in."""
    timed, at = [], 0.5
    for phone in SAID.split():
        length = {"SIL": 1.2}.get(phone, 0.16 if phone[0] in "AEIOU" else 0.1)
        timed.append((at, at + length, phone))
        at += length
    return timed


@pytest.fixture(scope="module")
def log_posteriors(phones):
    return posteriors_from_phones(phones, phones[-1][1] + 0.4, RATE)


def face_drawn(seed):
    """(50,) a face as seeds once drew it: the bounds below were measured on these."""
    drawn = np.random.default_rng(seed).normal(0, 0.85, 50)
    return np.clip(drawn, -2.5, 2.5).astype(np.float32)


def said_by(head, log_posteriors, seed, richness=None, name="once"):
    person = RichFace(head, face_drawn(seed), STYLES["plain"], richness, seed)
    count = round(len(log_posteriors) / RATE * FPS)
    return person.take(log_posteriors, RATE, frame_count=count, fps=FPS, name=name)


@pytest.fixture(scope="module", params=[3, pytest.param(11, marks=pytest.mark.slow)])
def take(request, head, log_posteriors):
    return said_by(head, log_posteriors, request.param)


@pytest.fixture(scope="module")
def vertices(take):
    return take.vertices()


def test_lips_are_sealed_at_p_b_and_m(head, phones, vertices):
    middles = [round((start + end) / 2 * FPS) for start, end, phone in phones if phone in "PBM"]
    assert gap_mm(head, vertices[middles]).max() <= 0.1


def test_lips_never_go_through_each_other(head, vertices):
    assert gap_mm(head, vertices).min() >= -0.1


def test_lips_stay_out_of_the_teeth(head, vertices):
    lips = np.unique(head.lip_rings[:9])
    worst = max(deepest_mm(v[lips], crowns(head, v)) for v in vertices[::6].astype(float))
    assert worst < 0.3


def test_the_mouth_opens_and_comes_back_to_its_own_rest(head, take, vertices):
    assert gap_mm(head, vertices)[:, 6].max() > 4
    apart = np.linalg.norm(vertices[[0, -1]] - take.face.template, axis=2)
    assert apart[0].max() < 0.0015  # breathing and brows go on
    assert apart[0].mean() < 1e-4


def test_teeth_stay_as_they_are(head, vertices):
    """The upper ones do not move; the lower ones as one piece, to a tenth of a millimetre."""
    upper, lower = head.regions["teeth_upper"], head.regions["teeth_lower"]
    assert np.abs(np.diff(vertices[:, upper], axis=0)).max() == 0
    pairs = vertices[:, lower[::97]]
    lengths = np.linalg.norm(pairs[:, 1:] - pairs[:, :1], axis=2)
    assert np.abs(lengths - lengths[0]).max() < 1e-4


def test_no_rig_of_the_package_spans_it(head, take, vertices):
    """ARKit's shapes leave a tenth of the face's motion and more; of a rig's they leave nothing."""
    basis = head.expression_basis.reshape(len(head.expression_names), -1).astype(float)
    directions = np.linalg.qr(basis.T)[0]
    moved = (vertices - take.face.template).reshape(len(vertices), -1)
    left = moved - (moved @ directions) @ directions.T
    face = head.regions["face"]

    def mean_mm(field):
        return 1000 * np.linalg.norm(field.reshape(len(field), -1, 3)[:, face], axis=2).mean()

    assert mean_mm(left) > 0.05
    assert mean_mm(left) > 0.1 * mean_mm(moved)


@pytest.fixture(scope="module")
def once(head, log_posteriors):
    """Somebody else's take."""
    return said_by(head, log_posteriors, 5)


def test_the_same_seed_is_the_same_person_and_take(head, log_posteriors, once):
    second = said_by(head, log_posteriors, 5)
    assert np.array_equal(once.vertices(30, 40), second.vertices(30, 40))


def test_another_take_is_not_the_same_twice(head, log_posteriors, once):
    again = said_by(head, log_posteriors, 5, name="again")
    apart = np.linalg.norm(once.vertices(20, 60) - again.vertices(20, 60), axis=2)
    assert 0.0003 < apart.max() < 0.02


def test_blocks_of_frames_are_those_of_the_whole(take, vertices):
    # Not to the bit: how a processor sums depends on how many rows are multiplied at once.
    assert np.abs(take.vertices(17, 23) - vertices[17:23]).max() < 1e-7


@pytest.mark.parametrize(
    "part",
    [
        "own_shapes",
        "flesh",
        *(pytest.param(n, marks=pytest.mark.slow) for n in ("habits", "slide", "prosody")),
    ],
)
def test_each_part_can_be_left_out_and_is_then_missed(head, log_posteriors, once, part):
    less = said_by(head, log_posteriors, 5, replace(FaceRichness(), **{part: 0.0})).vertices(20, 50)
    assert np.linalg.norm(once.vertices(20, 50) - less, axis=2).max() > 0.0002


@pytest.mark.slow
def test_swallowing_and_breathing_are_in_the_pauses(head, phones, log_posteriors):
    start, end = next((a, b) for a, b, phone in phones if phone == "SIL")
    middle = round((start + end) / 2 * FPS)
    names = {"swallowing": 0.0, "breathing": 0.0}
    moved = []
    for seed in range(3, 9):
        with_them = said_by(head, log_posteriors, seed, replace(FaceRichness(), prosody=0.0))
        without = said_by(head, log_posteriors, seed, replace(FaceRichness(), prosody=0.0, **names))
        frames = middle - 8, middle + 8
        apart = np.linalg.norm(with_them.vertices(*frames) - without.vertices(*frames), axis=2)
        moved.append(1000 * apart.max())
    assert max(moved) > 1.0  # somebody swallows
    assert max(moved) < 8.0


def test_without_anything_the_face_is_the_rigs_but_for_its_contacts(head, log_posteriors):
    nothing = FaceRichness(*(0.0 for _ in range(8)))
    take = said_by(head, log_posteriors, 3, nothing)
    rig = take.face.bare + np.tensordot(take.curves.values, head.expression_basis, 1)
    lips = take.face.contact.vertices
    bone = take.face.jaw_bone  # goes round where shapes go straight
    others = np.setdiff1d(np.arange(head.vertex_count), np.concatenate([lips, bone]))
    moved = take.vertices()
    assert np.abs(moved[:, others] - rig[:, others]).max() < 1e-5
    # The rig's lips overlap by up to 1.5 mm at a p, to close round holes too; a contact parts them.
    assert np.linalg.norm(moved[:, lips] - rig[:, lips], axis=2).max() < 0.006


def test_a_right_smile_is_mostly_the_mirror_image_of_the_left(head):
    from recipes.rich_faces.face_places import FLIP, face_places

    names = ("mouthSmileLeft", "mouthSmileRight")
    left, right = own_versions(head, face_places(head), names, 1.0, 0.15, 4)
    mirrored = right[head.mirror] * FLIP
    apart, length = np.linalg.norm(left - mirrored), np.linalg.norm(left)
    assert 0.02 < apart / length < 0.5


def test_flesh_follows_as_a_damped_spring():
    """Against small steps of the differential equation itself."""
    fps, hertz, damping = 60.0, 5.0, 0.4
    times = np.arange(90) / fps
    told = np.sin(2 * np.pi * 1.5 * times) * np.minimum(1, 4 * times)
    found = lagging(told[:, None], fps, np.array([hertz]), np.array([damping]))[0, :, 0]
    fine, omega = 400, 2 * np.pi * hertz
    at, speed, reference = told[0], 0.0, [told[0]]
    for frame in range(1, len(told)):
        for part in range(fine):
            share = (part + 0.5) / fine
            goal = (1 - share) * told[frame - 1] + share * told[frame]
            speed += (omega**2 * (goal - at) - 2 * damping * omega * speed) / (fps * fine)
            at += speed / (fps * fine)
        reference.append(at)
    assert np.abs(found - reference).max() < 2e-3
    assert np.abs(found - told).max() > 0.05


def test_flesh_at_rest_rests():
    told = np.ones((50, 3))
    assert np.allclose(lagging(told, 30.0, np.array([4.0]), np.array([0.5])), 1.0)


def test_scans_of_a_face_of_flesh_know_where_it_was(speech_wav):
    from elocute.audio.read import read_audio

    take = take_from_sound(read_audio(speech_wav), fps=30.0, seconds=0.4, identity="7", seed=2)
    assert take.frame_count == 12
    scanner = Scanner(points=8000, bumps_mm=0.0, turn_deg=0.0, shift_mm=0.0, seed=2)
    truth = ScanSimulator(take, scanner).truth(9)
    assert np.array_equal(truth.zero, take.vertices(9, 10)[0].astype(np.float64))
    assert len(ScanSimulator(take, scanner).frame(9).points) > 4000


def test_a_head_without_places_is_refused(head):
    bare = replace(head, mirror=np.zeros(0, np.int32))
    with pytest.raises(CaptureError, match="names no regions"):
        RichFace(bare, np.zeros(3), STYLES["plain"])


def test_an_extent_out_of_range_is_refused():
    with pytest.raises(CaptureError, match="flesh"):
        FaceRichness(flesh=-1.0)
