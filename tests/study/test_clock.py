"""A clock that is set back, or on, while people answer."""

import contextlib

import pytest

from elocute.study.serving.clock import SteadyClock
from elocute.study.serving.server import Serving, StudyService, read_texts
from elocute.study.serving.store import RefusedError, Store
from elocute.study.stimuli.manifest import open_study


@pytest.fixture
def answering(flashes, tmp_path):
    """What answers an order at a time of the clock, which begins at 2e9 s."""
    now, study = [2e9], open_study(flashes)
    with contextlib.closing(Store(study.design, tmp_path / "a.db", lambda: now[0])) as store:
        service = StudyService(study, store, Serving(), read_texts(("en",)))
        header = f"Bearer {service.join({'language': 'en'})['token']}"

        def person():
            found = service.person(header)
            assert found is not None
            return found

        service.check(person(), {"width": 800})

        def answer(order, at, seconds=0.5):
            now[0] = at
            body = {"order": order, "answer": "left", "seconds": seconds, "replays": 0}
            return service.answer(person(), body, at)["trial"]["order"]

        yield answer


def test_a_clock_that_is_set_back_refuses_nobody(answering):
    assert answering(1, 2e9 + 5) == 2
    assert answering(2, 2e9 - 3_600) == 3
    assert answering(3, 2e9 - 3_600 + 5) == 4


def test_a_clock_that_is_set_on_refuses_nobody(answering):
    assert answering(1, 2e9 + 3e7) == 2


@pytest.mark.parametrize("at", [2e9 + 0.1, 2e9 - 3_600])
def test_who_did_not_watch_is_early_whatever_the_clock_says(answering, at):
    with pytest.raises(RefusedError, match="early"):
        answering(1, at, seconds=0.1)


def test_time_goes_on_where_the_clock_is_set_back():
    wall = [1_000.0]
    clock = SteadyClock(lambda: wall[0])
    assert 1_000 <= clock() < 1_001
    wall[0] = 5_000.0
    assert 5_000 <= clock() < 5_001
    wall[0] = 10.0
    times = [clock() for _ in range(3)]
    assert times == sorted(times) and 5_000 <= times[0] < 5_010
