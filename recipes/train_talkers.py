"""Train the model `talkers` on tracked mouths of many people, and put it into the package.

    python -m recipes.train_talkers ../shared/data build/talkers             all of it
    python -m recipes.train_talkers ../shared/data build/talkers --held-out  what is chosen by

DATA has `talkers/train` and `grid_s1/clips` with `dev.txt`, in the layouts of `elocute evaluate
real`; `talkers/dev` and the clips of `dev.txt` are not opened. First every fourth talker and every
tenth sentence is held out: their correlations are printed, and from them comes how far the mouth
moves. Then networks of several seeds learn from everybody; the model is their mean. Features are
kept in the folder. On one core, about two minutes a network.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import torch

from elocute.array_types import Float64Array
from elocute.head.builtin import load_builtin_head
from elocute.models.talker_inputs import RULES_COLUMN, RULES_MIDDLE_MM, RULES_UNIT_MM
from elocute.motion.mouth_measures import MEASURES
from elocute.networks.talkers import MeanOfTalkerNets, TalkerNet
from elocute.training.onnx_export import export_network
from recipes.talkers.clips import Clip, read_clips, standardise
from recipes.talkers.fit import GUARD, FitSettings, fit
from recipes.talkers.selection import (
    Calibration,
    calibrate,
    correlations,
    split_sentences,
    split_talkers,
)

ASSET = Path(__file__).parents[1] / "src" / "elocute" / "models" / "assets" / "talkers.onnx"
NOTE = (
    "Trained by Elocute on tracked mouths of Arabic news talkers and of speaker 1 of GRID "
    "(recipes/train_talkers.py); docs/cards/talkers.md says more."
)
TRACE_ROWS = 50


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("folder", type=Path, help="for features; what is there is not made again")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--epochs", type=int, default=FitSettings.epochs)
    parser.add_argument("--channels", type=int, default=FitSettings.channels)
    parser.add_argument(
        "--held-out",
        action="store_true",
        help="stop before training on everybody; with -o, write what was judged",
    )
    parser.add_argument("--names", type=Path, help="write the names of held-out clips there")
    parser.add_argument("-o", "--output", type=Path, default=ASSET)
    choice = parser.parse_args()
    torch.set_num_threads(1)
    settings = FitSettings(epochs=choice.epochs, channels=choice.channels)
    words = read_clips(choice.data / "talkers" / "train", choice.folder / "talkers")
    measuring = (choice.data / "grid_s1" / "dev.txt").read_text(encoding="utf-8").split()
    grid = choice.data / "grid_s1" / "clips"
    sentences = read_clips(grid, choice.folder / "grid", leave_out=measuring)
    calibration, judged = held_out(words, sentences, settings, choice)
    if choice.held_out:
        if choice.output != ASSET:
            write_model(judged, calibration, choice.output)
        return
    speech = standardise([*words, *sentences])
    networks = [
        fit(words, sentences, speech, seed, settings, print) for seed in range(1, 1 + choice.seeds)
    ]
    write_model(networks, calibration, choice.output)
    print(f"{choice.output}: {choice.output.stat().st_size} bytes")


def held_out(
    words: list[Clip], sentences: list[Clip], settings: FitSettings, choice: argparse.Namespace
) -> tuple[Calibration, list[TalkerNet]]:
    """Train on some, tell how it does on the others, and how far people move beyond it."""
    (learned, other), (read, unread) = split_talkers(words), split_sentences(sentences)
    if choice.names is not None:
        choice.names.write_text("".join(f"{clip.name}\n" for clip in other), encoding="utf-8")
    speech = standardise([*words, *sentences])
    seeds = range(1, 1 + choice.seeds) if choice.held_out else (1,)
    networks = [fit(learned, read, speech, seed, settings, print) for seed in seeds]
    for title, clips in (("talkers", other), ("sentences", unread)):
        found = correlations(networks, clips)
        print(f"held-out {title}: {json.dumps({k: round(v, 3) for k, v in found.items()})}")
    eyes_mm = 1000 * load_builtin_head().eye_distance_m
    found = calibrate(networks, [*other, *unread], speech, middle_of_rules_mm(words), eyes_mm)
    print(json.dumps(found.record()))
    return found, networks


def middle_of_rules_mm(clips: list[Clip]) -> Float64Array:
    """(measure,) mean of what the rules make of speech on the head."""
    rows = np.concatenate(
        [clip.inputs[clip.speaking, RULES_COLUMN : RULES_COLUMN + len(MEASURES)] for clip in clips]
    )
    return (rows * RULES_UNIT_MM + RULES_MIDDLE_MM).mean(axis=0).astype(np.float64)


def write_model(networks: list[TalkerNet], calibration: Calibration, path: Path) -> None:
    """One file: the mean of networks, and what turns its outputs into millimetres."""
    inputs = networks[0].config.inputs
    record = {"kind": "talkers", "inputs": inputs, **calibration.record(), "note": NOTE}
    export_network(
        MeanOfTalkerNets(networks, GUARD),
        {"inputs": torch.zeros(1, TRACE_ROWS, inputs)},
        ["mouth"],
        {"inputs": {1: "row"}, "mouth": {1: "row"}},
        path,
        record=record,
        constants={},
    )


if __name__ == "__main__":
    main()
