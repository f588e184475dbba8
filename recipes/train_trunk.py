"""Teach the trunk, its mouth and its phones, and put them into the package.

    python -m recipes.train_trunk synthesise       # speech with exact phone times; may be left out
    python -m recipes.train_trunk align            # phones of natural English
    python -m recipes.train_trunk realign          # of German, Dutch and wake words
    python -m recipes.train_trunk fit WHISPER --held-out    # resumes from its checkpoint
    python -m recipes.train_trunk mouth WHISPER --held-out  # its mouth again, on readers too
    python -m recipes.train_trunk ship             # ONNX into the package
    python -m recipes.train_trunk sizes            # its sizes of movement; `ship` makes them too
    python -m recipes.train_trunk reference        # phones of the test clips for the benchmark

WHISPER is a published Whisper as CTranslate2's folder or model.bin, or as OpenAI's .pt (MIT); the
shipped trunk is made from `base`. DATA has `talkers/train`, `grid_s1/clips` with `dev.txt`,
`speech` and `readers`; `talkers/dev`, the clips of `dev.txt` and test speakers are never learned
from. Debian has the voices and the words: espeak-ng flite festival festvox-us-slt-hts
festvox-kallpc16k festvox-kdlpc16k hunspell-ru wamerican wngerman wdutch wfrench wspanish witalian
wpolish wswedish wbrazilian.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from elocute.array_types import Float32Array
from elocute.encoders.phones_and_visemes import SILENCE
from elocute.encoders.trunk import KIND, ROW_SAMPLES, SHIPPED_PATH, WHOLE
from elocute.models.talkers import SIZES_PATH, TalkersModel
from recipes.encoder import evaluate
from recipes.encoder.augment import Augmenter
from recipes.encoder.mixing import Mixer, read_noises
from recipes.encoder.natural import Recording, aligned_shard, list_recordings, read, split_of
from recipes.encoder.realign import realigned_shards
from recipes.encoder.reference import read_reference, write_reference
from recipes.encoder.store import HOP, UNKNOWN, VOICED, ShardWriter, load_shard
from recipes.trunk.calibration import calibrate
from recipes.trunk.export import export, scales
from recipes.trunk.fit import ROWS, FitSettings, fit
from recipes.trunk.judging import mouth_correlations, phone_figures
from recipes.trunk.mouth_teacher import Voice, teach_mouth
from recipes.trunk.mouths import MouthBatches, MouthClip, by_talker, read_mouths, standardise
from recipes.trunk.network import CONTEXT, LIVE_AHEAD, Trunk, TrunkConfig
from recipes.trunk.spectrum import BatchLogMel
from recipes.voice.made_sounds import made_sounds

NOTE = (
    "Made by Elocute from the first layers of Whisper base (OpenAI, MIT), taught on with tracked"
    " mouths of Arabic news talkers and of speaker 1 of GRID, and with read speech"
    " (recipes/train_trunk.py); docs/cards/trunk.md says more."
)
REFERENCE = Path(__file__).parents[1] / "benchmarks" / "encoder_reference.json"
NEVER_READ = "libri_other"
EVERY, FIRST = 8, 3  # of the talkers by number of clips, those held out
MADE_EACH = 10
AGAIN = {"trunk_rate": 1e-4, "head_rate": 5e-4}  # of phones that are taught on alone
FLITE_MINUTES, FESTIVAL_MINUTES = 35, 30
WORDS_EVERY, SENTENCES_EVERY = 8, 10  # of news talkers and GRID, that measure how far mouths move
JUDGED_EVERY = 6  # of the test recordings, while teaching
AHEADS = (25, WHOLE.ahead, LIVE_AHEAD)  # of files whose end is known, of files, of streams
VOICES = {"readers_train": 1, "untold_train": 2, "nat_train_*": 40}
"""Shards in whose recordings a teacher tells the mouths, one of so many of each."""


def read_speech(data: Path, work: Path, seed: int) -> Mixer:
    """Labelled speech of training speakers."""
    names = sorted(path.stem for path in work.glob("*.json") if "test" not in path.name)
    shards = [load_shard(work, name) for name in names]
    return Mixer(shards, read_all_noises(data), seed)


def read_all_noises(data: Path) -> list[Float32Array]:
    """What is heard behind voices."""
    return [*read_noises(sorted((data / "noise").glob("*.flac"))), *other_noises(2)]


def split_talkers(clips: Sequence[MouthClip]) -> tuple[list[MouthClip], list[MouthClip]]:
    """Clips to learn from, and those of talkers held out."""
    count = {talker: len(own) for talker, own in by_talker(clips).items()}
    ranked = sorted(count, key=lambda talker: (-count[talker], talker))
    held = set(ranked[FIRST::EVERY])
    return (
        [clip for clip in clips if clip.talker not in held],
        [clip for clip in clips if clip.talker in held],
    )


def synthesise(data: Path, work: Path) -> None:
    """Voices of espeak-ng, flite and festival."""
    from recipes.encoder import synthesise as voices

    voices.espeak_shard(work, voices.ESPEAK_MINUTES)
    voices.flite_shard(work, FLITE_MINUTES)
    voices.festival_shard(work, FESTIVAL_MINUTES)


def align(data: Path, work: Path, parts: int = 8) -> None:
    """Natural English, in parts, so that a stopped run goes on."""
    write_nothing(data, work)
    align_readers(data, work)
    recordings = [r for r in list_recordings(data) if r.language == "en" and r.text]
    recordings.sort(key=lambda r: hashlib.md5(r.path.name.encode()).hexdigest())
    for part in range(parts):
        for split in ("train", "test"):
            name = f"nat_{split}_{part}"
            if not (work / f"{name}.json").exists():
                chosen = [r for r in recordings[part::parts] if split_of(r) == split]
                print(name, aligned_shard(chosen, work, name), "of", len(chosen), flush=True)


def align_readers(data: Path, work: Path) -> None:
    """Phones of those readers whose texts are told; the others are heard without phones."""
    with (data / "readers" / "readers.tsv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))
    allowed = [row for row in rows if NEVER_READ not in row["path"]]
    recordings = [
        Recording(data / row["path"], "readers", row["speaker"], row["language"], row["text"], "")
        for row in allowed
        if row["text"]
    ]
    print("readers", aligned_shard(recordings, work, "readers_train"), "of", len(recordings))
    writer = ShardWriter()
    for row in allowed:
        if not row["text"]:
            samples = read(data / row["path"])
            labels = np.full(len(samples) // HOP, UNKNOWN, np.uint8)
            writer.add(
                samples,
                labels,
                speaker=row["speaker"],
                source="untold",
                language=row["language"],
                text="",
            )
    writer.save(work, "untold_train")


def other_noises(seed: int) -> list[Float32Array]:
    """Music, machines and barks, made by formula."""
    found = [sound for voice, sound in made_sounds(seed, MADE_EACH) if not voice]
    return [sound.astype(np.float32) for sound in found]


def write_nothing(data: Path, work: Path) -> None:
    """A shard of sounds in which nobody speaks, and one of song and laughter."""
    writer = ShardWriter()
    for sound in [*read_noises(sorted((data / "noise").glob("*.flac"))), *other_noises(1)]:
        labels = np.full(len(sound) // HOP, SILENCE, np.uint8)
        writer.add(sound, labels, speaker="", source="nothing", language="", text="")
    writer.save(work, "nothing_train")
    voices = ShardWriter()
    for voice, sound in made_sounds(1, MADE_EACH):
        if voice:
            samples = sound.astype(np.float32)
            loud = np.convolve(np.abs(samples), np.ones(HOP) / HOP, "same")[::HOP]
            labels = np.where(loud > 0.1 * loud.max(), VOICED, SILENCE)[: len(samples) // HOP]
            voices.add(samples, labels, speaker="", source="voices", language="", text="")
    voices.save(work, "voices_train")


def teach(chosen: argparse.Namespace) -> None:
    settings = FitSettings(minutes=chosen.minutes, seed=chosen.seed)
    if chosen.phones_alone:
        settings = replace(settings, phones_alone=True, mouths=1, speech=8, **AGAIN)
    data = chosen.data
    words, sentences = filmed(data)
    learned, other = split_talkers(words) if chosen.held_out else (words, [])
    standardise([*words, *sentences])
    speech = read_speech(data, chosen.work, settings.seed)
    augment = Augmenter(read_all_noises(data), settings.seed + 2)
    mouths = MouthBatches([*learned, *sentences], augment, ROWS, settings.seed)
    judged = [*read_mouths(data / "talkers" / "dev"), *other[::2]]
    spoken = read_reference(REFERENCE, data / "speech")[::JUDGED_EVERY]

    def report(trunk: Trunk) -> str:
        return judgement(trunk, judged, spoken)

    config = TrunkConfig(layers=chosen.layers)
    fit(chosen.whisper, config, mouths, speech, chosen.checkpoint, settings, report)


def filmed(data: Path) -> tuple[list[MouthClip], list[MouthClip]]:
    """Words of the news talkers, and sentences of GRID's man but for those that measure."""
    measuring = (data / "grid_s1" / "dev.txt").read_text(encoding="utf-8").split()
    return (
        read_mouths(data / "talkers" / "train"),
        read_mouths(data / "grid_s1" / "clips", leave_out=measuring),
    )


def read_voices(work: Path) -> list[Voice]:
    """Natural speech of training speakers, thinned: first readers, whose accents are many."""
    found = []
    for name, every in VOICES.items():
        for path in sorted(work.glob(f"{name}.json")):
            shard = load_shard(work, path.stem)
            for item in shard.items[::every]:
                samples = shard.samples(item)
                whole = len(samples) - len(samples) % ROW_SAMPLES
                found.append(Voice(item.speaker or item.source, samples[:whole]))
    return found


def teach_mouth_again(chosen: argparse.Namespace) -> None:
    """The mouth's head alone, through the layers that the checkpoint has."""
    state = torch.load(chosen.checkpoint, weights_only=True)
    trunk = Trunk(TrunkConfig(**state["config"]))
    kept = {name: x for name, x in state["mean"].items() if "mouth." not in name}
    trunk.load_state_dict(kept, strict=False)
    words, sentences = filmed(chosen.data)
    learned, other = split_talkers(words) if chosen.held_out else (words, [])
    standardise([*words, *sentences])
    augment = Augmenter(read_all_noises(chosen.data), chosen.seed)
    voices = read_voices(chosen.work)
    teach_mouth(trunk, chosen.whisper, learned, sentences, voices, augment, chosen.seed)
    heads = {name: x for name, x in trunk.state_dict().items() if "mouth." in name}
    for part in ("trunk", "mean"):
        state[part] |= heads
    torch.save(state, chosen.checkpoint)
    judged = [*read_mouths(chosen.data / "talkers" / "dev"), *other[::2]]
    print(judgement(trunk, judged, []))


def ship(chosen: argparse.Namespace) -> None:
    """The checkpoint as ONNX, with sizes of movement from people it did not learn from."""
    state = torch.load(chosen.checkpoint, weights_only=True)
    trunk = Trunk(TrunkConfig(**state["config"]))
    trunk.load_state_dict(state["mean"])
    trunk.eval()
    words, sentences = filmed(chosen.data)
    _, other = split_talkers(words)
    front_end = BatchLogMel(0)
    sounds = [clip.samples for clip in [*other[::10], *sentences[::SENTENCES_EVERY][::5]]]
    sounds += [one.samples for one in read_reference(REFERENCE, chosen.data / "speech")[::20]]
    bands = (
        front_end(torch.from_numpy(np.pad(x, (0, -len(x) % ROW_SAMPLES)))[None], CONTEXT)
        for x in sounds
    )
    record = {"kind": KIND, "note": NOTE}
    export(trunk, chosen.output, record, scales(trunk, bands))
    print(f"{chosen.output}: {chosen.output.stat().st_size} bytes")
    measure_sizes(chosen)


def measure_sizes(chosen: argparse.Namespace) -> None:
    """How far the mouth of the shipped trunk moves, by talkers held out and by GRID's man."""
    words, sentences = filmed(chosen.data)
    _, other = split_talkers(words)
    everybody = [words[::WORDS_EVERY], sentences[::SENTENCES_EVERY]]
    sizes = calibrate(TalkersModel(chosen.output), other, everybody)
    chosen.sizes.write_text(json.dumps(sizes, indent=1) + "\n", encoding="utf-8")


def judgement(
    trunk: Trunk, clips: Sequence[MouthClip], spoken: Sequence[evaluate.Utterance]
) -> str:
    """A line for each look-ahead."""
    lines = []
    for ahead in AHEADS:
        found = mouth_correlations(trunk, clips, ahead)
        shown = {name: found.pop(name) for name in list(found) if not name.startswith("ar")}
        for name, values in shown.items():
            lines.append(f"  ahead {ahead}: {name} {json.dumps(values)}")
        if found:
            mean = {
                field: round(sum(one[field] for one in found.values()) / len(found), 3)
                for field in next(iter(found.values()))
            }
            lines.append(f"  ahead {ahead}: {len(found)} talkers {json.dumps(mean)}")
        if english := [one for one in spoken if one.language == "en"]:
            lines.append(f"  ahead {ahead}: English phones {phone_figures(trunk, english, ahead)}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "step",
        choices=("synthesise", "align", "realign", "fit", "mouth", "ship", "sizes", "reference"),
    )
    parser.add_argument("whisper", type=Path, nargs="?")
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--work", type=Path, default=Path("build/trunk"))
    parser.add_argument("--checkpoint", type=Path, default=Path("build/trunk.pt"))
    parser.add_argument("--minutes", type=float, default=FitSettings.minutes)
    parser.add_argument("--layers", type=int, default=TrunkConfig.layers)
    parser.add_argument("--seed", type=int, default=FitSettings.seed)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--phones-alone", action="store_true", help="leave the mouth as it is")
    parser.add_argument("-o", "--output", type=Path, default=SHIPPED_PATH)
    parser.add_argument("--sizes", type=Path, default=SIZES_PATH, help="of movement, for the head")
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    chosen.work.mkdir(parents=True, exist_ok=True)
    if chosen.step == "fit":
        teach(chosen)
    elif chosen.step == "mouth":
        teach_mouth_again(chosen)
    elif chosen.step == "ship":
        ship(chosen)
    elif chosen.step == "sizes":
        measure_sizes(chosen)
    elif chosen.step == "realign":
        realigned_shards(chosen.data, chosen.work, [])
    elif chosen.step == "reference":
        names = sorted(path.stem for path in chosen.work.glob("*test*.json"))
        write_reference(chosen.work, names, REFERENCE)
    else:
        {"synthesise": synthesise, "align": align}[chosen.step](chosen.data, chosen.work)


if __name__ == "__main__":
    main()
