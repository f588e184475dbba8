"""Shards: what other tools read, what is refused, what goes on without."""

from __future__ import annotations

import hashlib
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from elocute.audio.read import read_audio
from elocute.corpus.shards import WordClip, open_shards, shard_writer
from elocute.errors import CorpusError
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion

FPS = 30.0


@pytest.fixture(scope="module")
def basis() -> Motion:
    head = load_builtin_head()
    few = replace(
        head,
        expression_names=head.expression_names[:28],
        expression_basis=head.expression_basis[:28],
    )
    return Motion(few, np.eye(28, dtype=np.float32), FPS)


@pytest.fixture(scope="module")
def sounds(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Path:
    """A folder with real speech in it."""
    root = tmp_path_factory.mktemp("sounds")
    (root / "deep").mkdir()
    whole = read_audio(speech_wav)
    soundfile.write(root / "deep" / "talk.flac", whole.samples, whole.sample_rate)
    return root


def word(number: int, **changed: Any) -> WordClip:
    frames = 10 + number % 5
    values = np.random.default_rng(number).normal(size=(frames, 28)).astype(np.float32)
    split = ("train", "train", "validation", "test")[number % 4]
    given = {
        "clip": f"w{number:03}",
        "word": f"word{number % 3}",
        "speaker": f"{split}-{number % 2}",
        "source": "alice",
        "split": split,
        "audio": "deep/talk.flac",
        "start_s": 0.2 * number,
        "end_s": 0.2 * number + frames / FPS,
        "fps": FPS,
        "parameters": values,
        "confidence": 0.5,
    }
    return WordClip(**{**given, **changed})


@pytest.fixture
def folder(tmp_path: Path, basis: Motion) -> Path:
    with shard_writer(tmp_path / "shards", basis, note="a note", rows=6) as writer:
        for number in range(20):
            writer.add(word(number))
    return tmp_path / "shards"


def test_what_was_written_is_read(folder: Path, sounds: Path) -> None:
    shards = open_shards(folder, sounds)
    assert (len(shards), len(shards.entries), shards.broken) == (20, 4, ())
    for number, clip in enumerate(shards.clips()):
        true = word(number)
        assert vars(clip).keys() == vars(true).keys()
        for name in vars(true):
            assert np.array_equal(getattr(clip, name), getattr(true, name)), name
    assert [c.clip for c in shards.clips("test")] == [f"w{n:03}" for n in range(3, 20, 4)]
    assert shards.basis.names == load_builtin_head().expression_names[:28]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such a name")
def test_a_folder_whose_name_is_no_text(tmp_path: Path, sounds: Path, basis: Motion) -> None:
    place = tmp_path / os.fsdecode(b"\xff\xfe")
    with shard_writer(place, basis) as writer:
        writer.add(word(0))
    (clip,) = open_shards(place, sounds).clips()
    assert clip.clip == "w000"


def test_sound_is_cut_to_the_sample(folder: Path, sounds: Path) -> None:
    shards = open_shards(folder, sounds)
    whole = read_audio(sounds / "deep" / "talk.flac")
    clip = word(3)
    first = round(clip.start_s * whole.sample_rate)
    cut = shards.sound(clip)
    assert np.array_equal(cut.samples, whole.samples[first : first + len(cut.samples)])
    assert cut.duration_s == pytest.approx(len(clip) / FPS, abs=1e-4)
    early = shards.sound(word(0), margin_s=0.25)
    lead = round(0.25 * whole.sample_rate)
    assert not early.samples[:lead].any()
    assert np.array_equal(early.samples[lead:], whole.samples[: len(early.samples) - lead])


def test_other_tools_read_them(folder: Path) -> None:
    duckdb, pandas = pytest.importorskip("duckdb"), pytest.importorskip("pandas")
    found = duckdb.sql(
        f"select split, count(*), sum(frames), max(parameters[1][28]) from '{folder}/*.parquet' "
        "group by split order by split"
    ).fetchall()
    clips = [word(number) for number in range(20)]
    for split, rows, frames, largest in found:
        mine = [clip for clip in clips if clip.split == split]
        assert (rows, frames) == (len(mine), sum(map(len, mine)))
        assert largest == pytest.approx(max(float(clip.parameters[0, 27]) for clip in mine))
    table = pandas.read_parquet(folder / "words-00000.parquet")
    assert np.array_equal(np.stack(table["parameters"][2]), word(2).parameters)


@pytest.mark.filterwarnings("ignore")
def test_ray_reads_them(folder: Path) -> None:
    pytest.importorskip("ray")
    import pyarrow.dataset

    # What Ray Data reads with, without starting a cluster for it.
    table = pyarrow.dataset.dataset([str(p) for p in sorted(folder.glob("*.parquet"))]).to_table()
    assert table.num_rows == 20
    assert np.array_equal(np.array(table["parameters"][7].as_py(), np.float32), word(7).parameters)


def test_damaged_shards_are_named_and_the_rest_goes_on(folder: Path, sounds: Path) -> None:
    shards = sorted(folder.glob("*.parquet"))
    shards[0].write_bytes(shards[0].read_bytes()[:-40])
    altered = bytearray(shards[1].read_bytes())
    altered[len(altered) // 2] ^= 1
    shards[1].write_bytes(altered)
    shards[2].unlink()
    opened = open_shards(folder, sounds)
    assert [name for name, _ in opened.broken] == [path.name for path in shards[:3]]
    assert [clip.clip for clip in opened.clips()] == ["w018", "w019"]
    shards[3].unlink()
    with pytest.raises(CorpusError, match=r"no shard that can be used.*words-00000"):
        open_shards(folder, sounds)


def test_a_speaker_in_two_splits_is_refused(
    tmp_path: Path, folder: Path, sounds: Path, basis: Motion
) -> None:
    with (
        pytest.raises(CorpusError, match="speaker eve: in train and in test"),
        shard_writer(tmp_path / "leak", basis) as writer,
    ):
        writer.add(word(0, speaker="eve"))
        writer.add(word(3, speaker="eve"))
    assert not (tmp_path / "leak").exists()
    from elocute.corpus.shards import write_manifest, write_shard

    # Somebody else's writer does not look: the reader does.
    other = tmp_path / "other"
    other.mkdir()
    entries = [
        write_shard(other / "a.parquet", [word(0, speaker="eve")], 28),
        write_shard(other / "b.parquet", [word(3, speaker="eve")], 28),
    ]
    write_manifest(other, entries, basis)
    with pytest.raises(CorpusError, match="speaker eve: in train and in test"):
        open_shards(other, sounds)


@pytest.mark.parametrize(
    "audio", ["../x.wav", "/etc/x.wav", "a/../../x.wav", "C:/x.wav", "a\\b", "", "a\nb.wav"]
)
def test_sounds_outside_are_refused(audio: str) -> None:
    with pytest.raises(CorpusError, match="below the folder of sounds"):
        word(1, audio=audio)


def test_links_that_lead_outside_are_refused(folder: Path, sounds: Path, speech_wav: Path) -> None:
    link = sounds / "link.flac"
    if not link.exists():
        link.symlink_to(speech_wav)
    with pytest.raises(CorpusError, match="outside the folder"):
        open_shards(folder, sounds).sound(word(1, audio="link.flac"))


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"parameters": np.full((3, 28), np.nan, np.float32)}, "NaN or infinity at frame 0"),
        ({"parameters": np.zeros((0, 28), np.float32)}, "shape"),
        ({"split": "dev"}, "split 'dev'"),
        ({"end_s": 0.0}, "times"),
        ({"start_s": float("nan")}, "times"),
        ({"fps": float("inf")}, "fps"),
        ({"confidence": 1.5}, "confidence"),
        ({"speaker": "../x"}, "speaker"),
        ({"word": ""}, "word"),
    ],
)
def test_malformed_clips_are_refused(changed: dict[str, Any], says: str) -> None:
    with pytest.raises(CorpusError, match=says):
        word(1, **changed)


def test_rows_of_other_writers_are_checked_too(tmp_path: Path, folder: Path, sounds: Path) -> None:
    import pyarrow.parquet as pq

    from elocute.files.reading import file_sha256

    path = folder / "words-00000.parquet"
    table = pq.read_table(path)
    names = ["../../secret.wav", *table["audio"].to_pylist()[1:]]
    import pyarrow as pa

    pq.write_table(
        table.set_column(table.schema.get_field_index("audio"), "audio", pa.array(names)), path
    )
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["shards"][0]["sha256"] = file_sha256(path)
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(CorpusError, match=r"words-00000.parquet, row 1: .*secret"):
        list(open_shards(folder, sounds).clips())


@pytest.mark.parametrize(
    "changed",
    [
        {"format": "x"},
        {"version": 9},
        {"shards": []},
        {"components": 0},
        {"shards": [1]},
        {"shards": [{"name": "../a.parquet", "rows": 1, "sha256": ""}]},
        {"components": "many"},
    ],
)
def test_other_manifests_are_refused(folder: Path, sounds: Path, changed: dict[str, Any]) -> None:
    record = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps({**record, **changed}))
    with pytest.raises(CorpusError, match="no manifest of shards"):
        open_shards(folder, sounds)


def test_places_are_checked(tmp_path: Path, folder: Path, sounds: Path, basis: Motion) -> None:
    with pytest.raises(CorpusError, match=r"no manifest.json"):
        open_shards(tmp_path, sounds)
    with pytest.raises(CorpusError, match="folder of the sounds"):
        open_shards(folder, tmp_path / "nowhere")
    with pytest.raises(CorpusError, match="start at 100"):
        open_shards(folder, sounds).sound(word(1, start_s=100.0, end_s=101.0))
    with pytest.raises(CorpusError, match="no clip"), shard_writer(tmp_path / "none", basis):
        pass


def forged(folder: Path, data: bytes) -> Path:
    """The folder with another first shard, which its manifest vouches for."""
    path = folder / "words-00000.parquet"
    path.write_bytes(data)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["shards"][0]["sha256"] = hashlib.sha256(data).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


@pytest.mark.parametrize("what", ["parameters", "clip"])
def test_a_small_shard_that_unpacks_to_much_is_refused(
    tmp_path: Path, folder: Path, sounds: Path, what: str
) -> None:
    """Run lengths make a billion values of a few bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(folder / "words-00000.parquet").slice(0, 1)
    if what == "parameters":
        values = pa.array(np.zeros(28 * 600_000, np.float32))
        rows = pa.FixedSizeListArray.from_arrays(values, 28)
        large = pa.ListArray.from_arrays(pa.array([0, 600_000], pa.int32()), rows)
    else:
        large = pa.array(["x" * 70_000_000])
    table = table.set_column(table.schema.get_field_index(what), what, large)
    pq.write_table(table, tmp_path / "a.parquet", compression="zstd")
    data = (tmp_path / "a.parquet").read_bytes()
    assert len(data) < 200_000
    broken = dict(open_shards(forged(folder, data), sounds).broken)
    assert "allowed: a shard that unpacks to 100 times its size" in broken["words-00000.parquet"]


def test_any_changed_byte_of_a_shard_is_read_or_refused(folder: Path, sounds: Path) -> None:
    """pyarrow ends the process where a footer lacks a part; the reader looks first."""
    data = (folder / "words-00000.parquet").read_bytes()
    footer = len(data) - 8 - int.from_bytes(data[-8:-4], "little")
    for place in range(footer, len(data), 29):
        changed = bytearray(data)
        changed[place] ^= 1 << place % 8
        try:
            shards = open_shards(forged(folder, bytes(changed)), sounds)
            assert sum(1 for _ in shards.clips()) in (14, 20)
        except CorpusError as error:
            assert "words-00000.parquet" in str(error)
