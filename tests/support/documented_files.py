"""The files that documented commands name, made small."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from elocute.studio import Project
from tests.support.documented_pages import ROOT
from tests.support.once_a_run import alone
from tests.support.stranger import write_stranger

SPEECH_S = 0.7
SPOKEN = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)
KNOWN = {
    "speech.txt": "Guten Morgen.",
    "lines.csv": "id,text,voice\na,Hello Bob.,f2\n",
    "speech.TextGrid": 'File type = "ooTextFile"\nObject class = "TextGrid"\n\n0\n0.7\n<exists>\n'
    '1\n"IntervalTier"\n"phones"\n0\n0.7\n2\n0\n0.3\n"M"\n0.3\n0.7\n"AE1"\n',
    "speech.json": '[{"AudioOffset": 500000, "VisemeId": 21}, {"AudioOffset": 2e6, "VisemeId": 2}]',
}
"""What is known of speech.wav and of lines to be spoken."""
CURVES = {
    "recorded.csv": "Timecode,JawOpen,HeadYaw,HeadPitch,HeadRoll\n"
    "00:00:00:00.000,0,0,0,0\n00:00:00:01.000,0.2,0,0.1,0\n",
    "a2f.json": '{"exportFps": 30, "facsNames": ["jawOpen"], "weightMat": [[0.1], [0.2]]}',
    "azure.json": json.dumps([{"FrameIndex": 0, "BlendShapes": [[0.1] * 55] * 2}]),
}
"""A face moved by other programs."""


def speech(seconds: float = SPEECH_S) -> tuple[np.ndarray, int]:
    samples, rate = soundfile.read(ROOT / "src/elocute/assets/example.flac", dtype="float32")
    first = 0 if seconds > 5 else rate
    return samples[first : first + round(seconds * rate)], rate


def file_maker(
    folder: Path, request: pytest.FixtureRequest, run: Callable[..., str]
) -> Callable[[str], Path]:
    """What makes a file of a name in a folder, once, with what it needs, for all workers.

    request: of a test that may ask for corpora and models. run: types a command.
    """
    marks = folder.with_name(f"{folder.name}.made")
    marks.mkdir(exist_ok=True)

    def make(name: str, place: Path) -> None:
        if name == "takes/line.elocute.json":
            Project(place.parent, "line.wav", settings={"fps": 10}).save(place)
        elif name == "takes":
            one("takes/line.wav")
            one("takes/line.elocute.json")
        elif name.endswith(".wav"):
            samples, rate = speech(11 if name == "reading.wav" else SPEECH_S)
            soundfile.write(place, samples, rate)
        elif name in ("clips", "lines"):
            place.mkdir()
            for clip in ("a.wav", "b.wav"):
                soundfile.write(place / clip, *speech())
        elif name == "talk.npz":
            run("animate", one("reading.wav"), "-o", place)
        elif name == "take.npz":
            run("animate", one("speech.wav"), "-o", place, "--fps", 5)
        elif name == "vertices.npy":
            run("animate", one("speech.wav"), "-o", place, "--fps", 10)
        elif name in ("corpus", "captured", "build/corpus"):
            request.getfixturevalue("make_corpus")(place, vertices=True, fps=30.0)
        elif name == "sequence":
            run(
                "capture",
                "simulate",
                one("speech.wav"),
                "-o",
                place,
                "--seconds",
                0.05,
                "--points",
                15000,
            )
        elif name == "study.toml":
            _study(place)
        elif name in ("ours", "theirs"):
            one("study.toml")  # it lies beside them
        elif name == "study":
            run("study", "new", one("study.toml"), "-o", place)
            answered(place)
        elif name == "whisper":
            shutil.copytree(request.getfixturevalue("whisper"), place)
        elif name == "hero.glb":
            shutil.copy(one("bust_arkit.glb"), place)
        elif name == "bust.glb":
            write_stranger(place)
        elif name == "bust.json":
            one("bust.glb")  # it lies beside it
        elif name in ("bust.npz", "bust_arkit.glb"):
            arguments = ("--keep-mesh", "--landmarks", one("bust.json"))
            run("head", "adopt", one("bust.glb"), *arguments, "-o", place)
        elif name == "face.ply":
            shutil.copy(one("sequence") / "00000.ply", place)
        elif name == "face.json":
            shutil.copy(one("sequence") / "landmarks" / "00000.json", place)
        elif name == "person.npz":
            marks = one("face.json")  # without them it is searched for, which takes twice as long
            run("head", "adopt", one("face.ply"), "--landmarks", marks, "-o", place)
        elif name == "speech.npz":
            run("blendshapes", "learn", one("corpus"), "-o", place, "--components", 3)
        elif name == "trained/model.onnx":
            shutil.copy(request.getfixturevalue("learned").model, place)
        elif name == "of_flame/model.onnx":
            corpus, trained = place.with_name("corpus"), place.with_name("trained")
            run("corpus", "convert", one("VOCASET"), "-o", corpus)
            run("train", "voca", corpus, "-o", trained, "--epochs", 1)
            shutil.copy(trained / "model.onnx", place)
        elif name == "captured/corpus":
            shutil.copytree(one("corpus"), place)
        elif name in ("mine.json", "new.json"):
            run(
                "style",
                "fit",
                one("talk.npz"),
                "--sound",
                one("speech.wav"),
                "--model",
                one("trained/model.onnx"),
                *(["--new"] if name == "new.json" else []),
                "-o",
                place,
            )
        elif name == "shards":
            shutil.copytree(request.getfixturevalue("speech_shards").folder, place)
        elif name == "recordings":
            shutil.copytree(request.getfixturevalue("speech_shards").sound_root, place)
        elif name == "drafts/ann.r000.json":
            run(
                "words",
                "segment",
                one("reading.wav"),
                "--text-file",
                one("reading.txt"),
                "-o",
                place,
            )
        elif name == "edit.TextGrid":
            run(
                "words",
                "check",
                one("drafts/ann.r000.json"),
                one("reading.wav"),
                "-o",
                place.with_name("page.html"),
                "--textgrid",
                place,
            )
        elif name.startswith("studies/"):
            shutil.copy(ROOT / name, place)
        elif name == "answers.csv":
            run("study", "simulate", one("studies/example.toml"), "-o", place, "--people", 14)
        elif name == "trial.csv":
            run("study", "simulate", one("study"), "-o", place, "--people", 14)
        elif name == "reading.txt":
            place.write_text(SPOKEN)
        elif name in ("take.json", "loop.json"):
            shutil.copy(ROOT / "examples" / name, place)
        elif name == "recordings.csv":
            place.write_text("id,audio\na,reading.wav\n")
        elif name in ("speech.txt", "lines.csv", "speech.TextGrid", "speech.json"):
            place.write_text(KNOWN[name])
        elif name in ("vocaset", "mine", "predicted", "others"):
            _make_benchmark(place, truth=name in ("vocaset", "mine"))
        elif name in ("lips.txt", "forehead.txt"):
            place.write_text("1\n2\n3\n")
        elif name in ("VOCASET", "generic_model.pkl"):
            _make_vocaset(place, name, request)
        elif name == "flame.npz":
            run("head", "adopt", one("generic_model.pkl"), "-o", place)
        elif name == "flame_talk.npz":
            head = one("flame.npz")
            run("animate", one("speech.wav"), "--head", head, "--fps", 5, "-o", place)
        elif name == "parameters.npz":
            solve = "solve", one("flame_talk.npz"), "--flame", one("generic_model.pkl")
            run(*solve, "-o", place)
        elif name in CURVES:
            place.write_text(CURVES[name])
        elif name == "tracked":
            _make_tracked(place)
        elif name == "flame_corpus":
            _make_flame_corpus(place, one("generic_model.pkl"))
        else:
            pytest.fail(f"a page names {name}, which nothing here makes")

    def one(name: str) -> Path:
        place, mark = folder / name, marks / name.replace("/", "-")
        if not mark.exists():
            place.parent.mkdir(exist_ok=True, parents=True)
            make(name, place)
            mark.touch()
        return place

    def give(name: str) -> Path:
        with alone(folder.with_name(f"{folder.name}.lock")):
            return one(name)

    return give


def _make_tracked(place: Path) -> None:
    """Two talkers whose mouths follow the loudness of what they say."""
    (place / "clips").mkdir(parents=True)
    samples, rate = speech()
    times = np.arange(round(len(samples) / rate * 25)) / 25
    loud = [np.abs(samples[round(t * rate) : round((t + 0.04) * rate)]).mean() for t in times]
    opening = np.array(loud) / max(loud) * 0.1
    fields = {"t": times, "valid": np.ones(len(times)), "inner_opening_mean": opening}
    records = []
    for name, talker in (("one", "ann"), ("two", "bob")):
        soundfile.write(place / "clips" / f"{name}.wav", samples, rate)
        np.savez(place / "clips" / f"{name}.npz", lip_width=0.6 - opening, words="[]", **fields)
        records.append({"id": name, "speaker": talker, "language": "en", "offset_s": 0.0})
    (place / "manifest.json").write_text(json.dumps({"clips": records}))


def _make_benchmark(place: Path, *, truth: bool) -> None:
    """A test clip of VOCASET as FaceFormer keeps it, or a prediction of it."""
    from elocute.corpus.importers.split_choice import VOCASET_TEST

    subject = VOCASET_TEST[0]
    face = np.random.default_rng(0).uniform(-0.1, 0.1, (5023, 3))
    frames = np.repeat(face.astype(np.float32)[None], 8, axis=0)
    folder = place / "vertices_npy" if truth else place
    folder.mkdir(parents=True)
    condition = "" if truth else f"_condition_{subject}"
    np.save(folder / f"{subject}_sentence21{condition}.npy", frames.reshape(8, -1))
    if truth:
        (place / "templates.pkl").write_bytes(pickle.dumps({subject: face}))


def _make_vocaset(place: Path, name: str, request: pytest.FixtureRequest) -> None:
    from elocute.corpus.importers import split_choice

    python2: Any = request.getfixturevalue("python2")
    if name == "VOCASET":
        people = (
            split_choice.VOCASET_TRAIN[0],
            split_choice.VOCASET_TRAIN[1],
            split_choice.VOCASET_VALIDATION[0],
            split_choice.VOCASET_TEST[0],
        )
        request.getfixturevalue("sources").write_vocaset(place, python2, people)
    else:
        from tests.support.flame_layout import flame_layout

        place.write_bytes(python2.dumps(flame_layout().entries))


def _make_flame_corpus(place: Path, flame: Path) -> None:
    """Two sentences of one subject on FLAME's mesh, a few frames each."""
    from elocute.audio.waveform import Waveform
    from elocute.corpus.clip import Clip
    from elocute.corpus.corpus_writing import corpus_writer
    from elocute.head.flame import flame_vertices, load_flame

    model = load_flame(flame)
    with corpus_writer(
        place, {"ada": model.template.astype(np.float32)}, fps=60, topology="flame"
    ) as writer:
        for sentence in ("one", "two"):
            pose = np.zeros((3, 15))
            pose[:, 6] = [0, 0.1, 0.2]
            frames = flame_vertices(model, expression=[0.5, -1], pose=pose).astype(np.float32)
            sound = Waveform(np.zeros(800, np.float32), 16000)
            writer.add(Clip("ada", sentence, "", sound, frames))


def _study(place: Path) -> None:
    """The file of docs/use/study.md, beside two folders of videos."""
    from tests.study.studies import two_folders

    two_folders(place.parent)
    page = (ROOT / "docs/use/study.md").read_text(encoding="utf-8")
    text = page.split("```toml\n")[1].split("```")[0]
    place.write_text(text.replace("[stimuli]", "[stimuli]\nsize = [64, 64]"), encoding="utf-8")


def answered(folder: Path) -> None:
    """Answers of four people, beside a study."""
    from elocute.study.serving.store import Store
    from elocute.study.stimuli.manifest import open_study

    store = Store(open_study(folder).design, folder / "answers.db")
    for _ in range(4):
        _, person = store.join("en")
        while (shown := person.next) is not None:
            given = shown.trial.correct or shown.left
            person = store.answer(person, shown.order, given, seconds=2.0, replays=0)
    store.close()
