"""The nuclear norm of the whitened cross-covariance, its sub-gradient, and monotonic attention."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba", reason="needs the extra `wild`")

from elocute.alignment.cca import whiten_pair
from elocute.errors import AlignmentError


def views(frames: int = 40) -> list[np.ndarray]:
    rng = np.random.default_rng(frames)
    common = rng.normal(size=(frames, 3))
    return [
        common @ rng.normal(size=(3, width)) + 0.5 * rng.normal(size=(frames, width))
        for width in (4, 5)
    ]


def test_the_closed_form_is_the_slope_of_finite_differences() -> None:
    first, second = views()
    slopes = whiten_pair(first, second).gradients()
    rng = np.random.default_rng(0)
    for place, slope in enumerate(slopes):
        step = 1e-5 * rng.normal(size=slope.shape)
        moved = [[first, second], [first, second]]
        moved[0][place], moved[1][place] = moved[0][place] + step, moved[1][place] - step
        up, down = (whiten_pair(one, other).norm for one, other in moved)
        assert (up - down) / 2 == pytest.approx(float((slope * step).sum()), rel=1e-6)


def test_the_closed_form_is_what_autograd_finds() -> None:
    torch = pytest.importorskip("torch", reason="needs the extra `train`")
    first, second = (torch.tensor(view, requires_grad=True) for view in views())

    def root(centred):
        covariance = centred.T @ centred / (len(centred) - 1)
        values, vectors = torch.linalg.eigh(covariance + 1e-3 * torch.eye(len(covariance)))
        return vectors @ torch.diag(values**-0.5) @ vectors.T

    a, b = first - first.mean(0), second - second.mean(0)
    k = root(a) @ (a.T @ b / (len(a) - 1)) @ root(b)
    norm = torch.linalg.matrix_norm(k, "nuc")
    norm.backward()
    pair = whiten_pair(first.detach().numpy(), second.detach().numpy())
    assert pair.norm == pytest.approx(norm.item())
    for slope, tensor in zip(pair.gradients(), (first, second), strict=True):
        np.testing.assert_allclose(slope, tensor.grad.numpy(), atol=1e-9)


def test_equal_views_correlate_fully_and_constant_ones_not_at_all() -> None:
    first = views()[0]
    assert whiten_pair(first, first, 1e-9).norm == pytest.approx(4, abs=1e-5)
    assert whiten_pair(first, np.ones((40, 2))).norm == pytest.approx(0, abs=1e-9)
    with pytest.raises(AlignmentError, match="equally many"):
        whiten_pair(first, first[:-1])
    with pytest.raises(AlignmentError, match="ridge"):
        whiten_pair(first, first, 0)


@pytest.mark.parametrize("free_start", [False, True])
def test_monotonic_attention_sums_to_one_and_is_the_expected_reader(free_start: bool) -> None:
    torch = pytest.importorskip("torch", reason="needs the extra `train`")
    from elocute.networks.dcaw import monotonic_attention

    torch.manual_seed(0)
    scores = torch.randn(2, 6, 4)
    mask = torch.ones(2, 6)
    mask[1, 4:] = 0
    found = monotonic_attention(scores, mask, free_start)
    torch.testing.assert_close(found.sum(dim=1), torch.ones(2, 4))
    assert (found[1, 4:] == 0).all()
    # The recursion, cell by cell: where it stood, how far it walks on, where it stops.
    stops = torch.sigmoid(scores[0]).double()
    last = torch.full((6,), 1 / 6) if free_start else torch.eye(6)[0]
    for j in range(4):
        here = torch.zeros(6, dtype=torch.float64)
        for k in range(6):
            for i in range(k, 6):
                here[i] += last[k] * torch.prod(1 - stops[k:i, j]) * stops[i, j]
        last = here / here.sum()
        torch.testing.assert_close(found[0, :, j].double(), last, atol=1e-5, rtol=1e-4)
