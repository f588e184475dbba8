"""The command line as a person meets it: real files, and one real process of each kind."""

import json
import resource

import numpy as np
import pytest
import soundfile

from tests.support.commands import one_line, run_apart, run_here, run_python

COMMANDS = (
    "animate",
    "render",
    "measure",
    "info",
    "doctor",
    "edit",
    "solve",
    "head",
    "corpus",
    "train",
    "style",
    "evaluate",
    "capture",
    "blendshapes",
)


def refused(*arguments, says=()):
    one_line(run_here(*arguments), *says)


@pytest.fixture(scope="module")
def talk(speech_wav, tmp_path_factory):
    """A folder with an animated example."""
    folder = tmp_path_factory.mktemp("talk")
    outputs = ("-o", folder / "talk.npz", "-o", folder / "talk.csv")
    result = run_apart("animate", speech_wav, *outputs)
    assert result.returncode == 0, result.stderr
    return folder


def test_help_names_every_command_and_is_quick():
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = run_apart("--help")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # Of the processor, so that a busy machine changes little: 0.3 s, see the benchmark.
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 1
    for command in COMMANDS:
        assert command in result.stdout
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command):
    result = run_here(command, "--help")
    assert result.returncode == 0 and "Usage" in result.stdout


def test_importing_needs_neither_torch_nor_onnxruntime():
    code = (
        "import sys, elocute; from elocute.cli.app import command_line; command_line(); "
        "print([m for m in ('torch', 'onnxruntime', 'scipy', 'av') if m in sys.modules])"
    )
    output = run_python("-c", code)
    assert output.stdout.strip() == "[]", output.stdout + output.stderr


def test_animate_writes_what_was_asked(talk):
    assert sorted(p.name for p in talk.iterdir()) == ["talk.csv", "talk.npz"]


def test_json_is_one_record_for_machines(speech_wav, tmp_path):
    result = run_here("animate", speech_wav, "-o", tmp_path / "t.npz", "--fps", "25", "--json")
    record = json.loads(result.stdout)
    assert record["fps"] == 25 and record["frames"] == 267
    assert record["outputs"] == [str(tmp_path / "t.npz")]


def test_measure_writes_a_table_and_a_plot(talk, tmp_path):
    result = run_here(
        "measure", talk / "talk.npz", "-o", tmp_path / "mouth.csv", "--plot", tmp_path / "m.png"
    )
    assert result.returncode == 0, result.stderr
    rows = np.genfromtxt(tmp_path / "mouth.csv", delimiter=",", names=True)
    assert rows.dtype.names == ("time_s", "opening_mm", "width_mm", "protrusion_mm", "jaw_mm")
    assert rows["opening_mm"].max() > 5 and rows["opening_mm"][0] == 0
    from PIL import Image

    with Image.open(tmp_path / "m.png") as picture:
        assert picture.size[0] == 1400


def test_render_writes_other_formats_from_a_stored_motion(talk, speech_wav, tmp_path):
    result = run_here(
        "render",
        talk / "talk.npz",
        "--audio",
        speech_wav,
        "--fps",
        "1",
        "--size",
        "64",
        "-o",
        tmp_path / "t.mp4",
        "-o",
        tmp_path / "t.glb",
        "--embed-audio",
        "--backend",
        "embreex",
    )
    assert result.returncode == 0, result.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.glb", "t.mp4"]


def test_info_says_what_a_file_holds(talk, speech_wav):
    sound = json.loads(run_here("info", speech_wav, "--json").stdout)
    assert sound["sample_rate"] == 32000 and sound["channels"] == 1
    motion = json.loads(run_here("info", talk / "talk.npz", "--json").stdout)
    assert motion["frames"] == 640 and "jawOpen" in motion["moving"]


def test_doctor_finds_a_renderer_and_the_assets():
    record = json.loads(run_here("doctor", "--json").stdout)
    assert record["renderer embreex"].startswith("works")
    assert record["head"].endswith("MB)") and record["encoder"].endswith("MB)")
    assert record["viewer"].endswith("MB)")


def test_a_folder_of_recordings(speech_wav, tmp_path):
    samples, rate = soundfile.read(speech_wav)
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    for name in ("a", "b"):
        soundfile.write(tmp_path / "in" / f"{name}.wav", samples[: rate * 2], rate)
    result = run_here("animate", tmp_path / "in", "-o", tmp_path / "out", "--format", "csv")
    assert result.returncode == 0, result.stderr
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["a.csv", "b.csv"]


def test_one_bad_recording_does_not_stop_the_others(speech_wav, tmp_path):
    bad, out = tmp_path / "bad.wav", tmp_path / "out"
    bad.write_text("not sound at all")
    out.mkdir()
    result = run_here("animate", bad, speech_wav, "-o", out)
    assert result.returncode == 1
    assert "bad.wav" in result.stderr and "1 of 2 failed" in result.stderr
    assert [p.name for p in out.iterdir()] == ["example.npz"]


class TestRefusals:
    """Each gives one line and writes nothing."""

    def test_a_missing_file(self, tmp_path):
        refused("animate", tmp_path / "no.wav", "-o", tmp_path / "t.npz", says=["no.wav"])
        assert list(tmp_path.iterdir()) == []

    def test_text_called_wav(self, tmp_path):
        (tmp_path / "a.wav").write_text("hello")
        one_line(run_apart("animate", tmp_path / "a.wav", "-o", tmp_path / "t.npz"), "a.wav")

    def test_an_unknown_suffix(self, speech_wav, tmp_path):
        refused("animate", speech_wav, "-o", tmp_path / "t.avi", says=[".avi", ".mp4"])

    def test_a_missing_folder(self, speech_wav, tmp_path):
        refused("animate", speech_wav, "-o", tmp_path / "no" / "t.npz", says=["mkdir"])

    def test_the_recording_as_output(self, tmp_path):
        import av

        path = tmp_path / "talk.mp4"
        with av.open(str(path), "w") as file:
            stream = file.add_stream("aac", rate=16000, layout="mono")
            frame = av.AudioFrame.from_ndarray(np.zeros((1, 16000), np.float32), "fltp", "mono")
            frame.sample_rate = 16000
            for packet in [*stream.encode(frame), *stream.encode(None)]:
                file.mux(packet)
        before = path.read_bytes()
        refused("animate", path, "-o", path, says=["an input of this run"])
        assert path.read_bytes() == before

    @pytest.mark.parametrize(
        ("option", "value", "word"),
        [
            ("--fps", "0", "fps"),
            ("--fps", "many", "fps"),
            ("--identity", "nobody", "nobody"),
            ("--style", "operatic", "calm"),
            ("--strength", "7", "strength"),
            ("--channel", "5", "channel"),
            ("--size", "12x", "--size"),
            ("--model", "magic", "articulation"),
            ("--phones", "none.csv", "none.csv"),
            ("--colour", "red", "--colour"),
        ],
    )
    def test_an_option_that_makes_no_sense(self, speech_wav, tmp_path, option, value, word):
        out = tmp_path / ("t.mp4" if option == "--size" else "t.npz")
        refused("animate", speech_wav, "-o", out, option, value, says=[word])
        assert list(tmp_path.iterdir()) == []

    def test_no_output(self, speech_wav):
        refused("animate", speech_wav, says=["output"])

    def test_a_motion_that_is_none(self, tmp_path):
        (tmp_path / "m.npz").write_bytes(b"PK junk")
        refused("measure", tmp_path / "m.npz", "-o", tmp_path / "m.csv", says=["m.npz"])
        refused("render", tmp_path / "m.npz", "-o", tmp_path / "m.glb", says=["m.npz"])

    def test_an_unknown_backend(self, speech_wav, tmp_path):
        out = tmp_path / "t.mp4"
        refused("animate", speech_wav, "-o", out, "--backend", "crayon", says=["crayon"])
        assert list(tmp_path.iterdir()) == []


@pytest.mark.shared_data
def test_evaluate_real_reports_correlation_and_closures(shared_data, tmp_path):
    folder = shared_data / "grid_s1"
    names = tmp_path / "names.txt"
    names.write_text("\n".join((folder / "dev.txt").read_text().split()[:8]))
    # The default's mouth shuts on b and p before any contact is laid over it; the rules' does not.
    measure = ("evaluate", "real", folder / "clips", "--names", names, "--model", "articulation")
    summary = json.loads(run_here(*measure, "--json").stdout)["summary"]
    assert summary["takes"] == 8
    assert summary["opening_best_r"] > 0.5
    assert summary["closure_recall"] > 0.5
    both = run_here(*measure, "--contacts", "both").stdout
    table = {line.split()[0]: line.split()[1:] for line in both.splitlines()}
    assert table["contacts"] == ["off", "auto"] and table["takes"] == ["8", "8"]
    assert float(table["closure_recall"][1]) == pytest.approx(summary["closure_recall"], abs=6e-4)
    assert float(table["closure_recall"][0]) < float(table["closure_recall"][1])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (
            ["-o", "t.csv", "--size", "640x640"],
            "t.csv: --size is not an option of .csv; allowed: none",
        ),
        (
            ["-o", "t.glb", "--view", "side"],
            "--view is not an option of .glb; allowed: --profile, --visemes, --action, --embed",
        ),
        (["-o", "t.csv", "-o", "t.npz", "--title", "a"], "t.csv: --title is not an option of .csv"),
        (
            ["-o", "t.png", "--backend", "none"],
            "--backend: 'none'; allowed: auto, moderngl, embreex",
        ),
        (["-o", "-", "--format", "csv", "--embed-audio"], "--embed-audio is not an option of .csv"),
    ],
)
def test_an_option_that_no_output_has_is_refused(speech_wav, tmp_path, options, told):
    placed = [tmp_path / word if word.startswith("t.") else word for word in options]
    result = run_here("animate", speech_wav, *placed)
    assert result.returncode == 2 and told in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_of_several_outputs_each_takes_the_options_that_it_has(speech_wav, tmp_path):
    page, table = tmp_path / "t.html", tmp_path / "t.csv"
    result = run_here("animate", speech_wav, "-o", page, "-o", table, "--title", "Hello there")
    assert result.returncode == 0, result.stderr
    assert "<title>Hello there</title>" in page.read_text(encoding="utf-8") and table.is_file()


def test_memory_that_is_not_there_is_one_line(monkeypatch):
    from elocute.cli import entry_point

    def refused_memory():
        raise MemoryError("Unable to allocate 1.3 TiB")

    monkeypatch.setattr(entry_point, "_run_app", refused_memory)
    told = run_here("info", "a.wav")
    assert (told.returncode, told.stderr.count("\n")) == (1, 1)
    assert told.stderr.startswith("elocute: not enough memory")


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (RecursionError("maximum recursion depth exceeded"), "lists within lists too deeply"),
        (np.linalg.LinAlgError("SVD did not\nconverge"), "no solution fits (SVD did not converge)"),
    ],
)
def test_what_a_library_gives_up_on_is_one_line(monkeypatch, error, told):
    from elocute.cli import entry_point

    def given_up():
        raise error

    monkeypatch.setattr(entry_point, "_run_app", given_up)
    done = run_here("info", "a.wav")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert told in done.stderr
