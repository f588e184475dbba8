"""The three terms of Karras et al. 2017, section 4.3, and how they are balanced (section 4.4)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

DECAY = 0.99  # of the running averages
TINY = 1e-8
TERMS = ("position", "motion", "emotion")


def loss_terms(predicted: Tensor, target: Tensor, emotions: Tensor, vertices: int) -> Tensor:
    """(3,): position mm², motion mm² and emotion.

    predicted, target: (run, frame, output) mm; emotions: (run, frame, emotion). With two frames in
    a run these are the paper's terms: the position is the mean squared difference of coordinates,
    the motion twice that of their steps from frame to frame, the emotion twice the mean squared
    step of the emotional state, divided by its mean square in the batch, which makes it
    independent of the scale of the state.
    """
    coordinates = 3 * vertices
    error = predicted - target
    position = error.square().sum(dim=-1).mean() / coordinates
    motion = 2 * error.diff(dim=1).square().sum(dim=-1).mean() / coordinates
    steps = 2 * emotions.diff(dim=1).square().mean()
    return torch.stack([position, motion, steps / (emotions.square().mean() + TINY)])


class Balance(nn.Module):
    """Divides each term by the root of a running average of its square.

    As Adam normalises gradients: averages start from zero, and their bias is taken out. All terms
    then weigh alike, whatever their units.
    """

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("squares", torch.zeros(len(TERMS), dtype=torch.float64))
        self.register_buffer("steps", torch.zeros((), dtype=torch.float64))

    def forward(self, terms: Tensor) -> Tensor:
        """One number to minimise."""
        with torch.no_grad():
            self.steps += 1
            self.squares.lerp_(terms.double().square(), 1 - DECAY)  # pyright: ignore
            level = (self.squares / (1 - DECAY**self.steps)).sqrt()  # pyright: ignore
        return (terms / (level.to(terms) + TINY)).sum()
