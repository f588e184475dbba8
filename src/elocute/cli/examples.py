"""What each command's `--help` shows: lines that can be copied, without their first word."""

from __future__ import annotations

EXAMPLES: dict[str, tuple[str, ...]] = {
    "": ("animate speech.wav -o talk.mp4", "animate --help"),
    "animate": (
        "animate speech.wav -o talk.mp4",
        "animate speech.wav -o talk.glb -o talk.html --identity hana --style broad",
        "animate speech.wav -o talk.glb --transcribe --language de",
        "animate clips/ -o out/ --format glb --format csv",
        "animate - -o - --format json < speech.wav > talk.json",
    ),
    "a2f": ("a2f", "a2f --port 52001 --mood happy"),
    "live": (
        "live speech.wav --to livelink",
        "live mic --to vmc --to json=127.0.0.1:9000 --mood happy",
    ),
    "say": (
        'say "Give me any voice." -o talk.glb',
        "say --file speech.txt -o talk.mp4 --language de --voice f2 --rate 140",
    ),
    "phones": (
        "phones speech.wav -o speech.TextGrid",
        "phones speech.wav --text-file speech.txt -o speech.json",
    ),
    "cues": (
        "cues speech.wav -o mouth.tsv",
        "cues speech.wav --text-file speech.txt -o mouth.dat -o captions.srt",
        "cues speech.wav --transcribe -o captions.vtt",
    ),
    "render": (
        "render talk.npz --audio speech.wav -o talk.mp4 --size 1080p",
        "render talk.npz --fps 30 -o talk.csv",
    ),
    "edit": (
        'edit talk.npz -o out.glb --blinks 0.5,2.1 --neck "0:0,0,0; 1:5,10,0"',
        "edit talk.npz --audio speech.wav -o part.mp4 --from 1 --to 2.5 --identity ada",
    ),
    "solve": ("solve vertices.npy -o talk.npz --fps 60",),
    "convert": (
        "convert take.npz --to oculus -o visemes.csv",
        "convert take.npz --to flame --flame generic_model.pkl -o parameters.npz",
    ),
    "measure": ("measure talk.npz -o mouth.csv --plot mouth.png",),
    "info": ("info speech.wav", "info talk.npz --json"),
    "doctor": ("doctor",),
    "align": (
        "align captured.wav other.wav --method dtw --plot path.png",
        "align sentence.wav word.wav --find --json",
    ),
    "propagate": ("propagate captured/ recordings/ -o shards/ --words words/ --jobs 2",),
    "evaluate": ("evaluate corpus corpus/ --model voca",),
    "evaluate alignment": ("evaluate alignment aligned/ --methods diagonal,dtw",),
    "evaluate benchmark": (
        "evaluate benchmark vocaset result/ --truth vocaset/vertices_npy --table scores.tex",
        "evaluate benchmark biwi predicted/ others/ --truth BIWI/ --json",
    ),
    "evaluate corpus": ("evaluate corpus corpus/ --model trained/model.onnx --style best",),
    "evaluate features": ("evaluate features corpus/ --encoders phones,fbank -o runs/",),
    "evaluate wild": ("evaluate wild shards/ recordings/ -o wild/ --sentences corpus/",),
    "evaluate noise": (
        "evaluate noise speech.wav --model articulation --model voca --plot noise.png",
        "evaluate noise speech.wav --noise babble --noise telephone",
    ),
    "evaluate styles": ("evaluate styles speech.wav --plot styles.png",),
    "evaluate identities": (
        "evaluate identities speech.wav --model voca --contacts both --count 10",
        "evaluate identities talk.npz --identity mean -o worst.json",
    ),
    "evaluate real": ("evaluate real clips/ --contacts both",),
    "head": ("head show builtin",),
    "head show": ("head show generic_model.pkl",),
    "head adopt": (
        "head adopt generic_model.pkl -o flame.npz",
        "head adopt face.ply -o person.npz",
        "head adopt bust.glb --keep-mesh --landmarks bust.json -o bust.npz",
    ),
    "head sample": (
        "head sample --count 20 -o faces.png",
        "head sample --count 5 -o faces/ --format ply",
    ),
    "corpus": ("corpus info corpus/",),
    "corpus info": ("corpus info corpus/",),
    "corpus check": ("corpus check corpus/ --json",),
    "corpus convert": ("corpus convert VOCASET/ -o corpus/",),
    "capture": ("capture scans sequence/ -o captured/",),
    "capture scan": ("capture scan face.ply -o registered.ply --unit mm",),
    "capture scans": (
        "capture scans sequence/ -o captured/ --jobs 2",
        "capture scans sequence/ -o published/ --method nicp --template adaptive",
    ),
    "capture check": ("capture check sequence/",),
    "capture simulate": (
        "capture simulate speech.wav -o sequence/ --seconds 1",
        "capture simulate speech.wav -o sequence/ --seconds 1 --seed 3",
    ),
    "capture landmarks": ("capture landmarks sequence/", "capture landmarks face.ply -o face.html"),
    "capture video": (
        "capture video me.mp4 -o me.glb",
        "capture video takes/*.mp4 -o corpus/ --subject ada",
    ),
    "blendshapes": ("blendshapes learn corpus/ -o speech.npz",),
    "blendshapes learn": ("blendshapes learn corpus/ -o speech.npz --components 28",),
    "blendshapes show": ("blendshapes show speech.npz -o shapes.png",),
    "blendshapes compare": ("blendshapes compare corpus/ speech.npz --plot errors.png",),
    "style": ("style fit talk.npz --sound speech.wav --model voca",),
    "style fit": ("style fit talk.npz --sound speech.wav --model trained/model.onnx -o mine.json",),
    "train": ("train voca corpus/ -o trained/",),
    "train voca": (
        "train voca corpus/ -o trained/ --epochs 50",
        "train voca corpus/ -o trained/ --resume",
    ),
    "train crnn": (
        "train crnn shards/ recordings/ -o trained/",
        "train crnn shards/ recordings/ -o published/ --preset paper",
    ),
    "train karras": (
        "train karras corpus/ -o trained/",
        "train karras corpus/ -o trained/ --preset paper --device cuda",
    ),
    "study": ("study new study.toml -o study/",),
    "study new": (
        "study new study.toml -o study/",
        "study new studies/voca_binary.toml -o study/ --data recordings/ --jobs 0",
    ),
    "study serve": (
        "study serve study/",
        "study serve study/ --public study.example.org --database postgresql://localhost/study",
    ),
    "study links": ("study links study/ --count 20",),
    "study report": (
        "study report study/ -o report/",
        "study report study.toml --answers answers.csv -o report/",
    ),
    "study plan": (
        "study plan --share 0.6 --trials 10 --stimuli 20",
        "study plan study.toml --share 0.5 --equivalent",
    ),
    "study simulate": ("study simulate study.toml -o answers.csv --people 40 --level rules=0.5",),
    "study export": ("study export study/ -o answers.csv",),
    "studio": (
        "studio takes/",
        "studio takes/line.elocute.json --no-open",
        "studio takes/ --export pages/",
    ),
    "words": ("words segment reading.wav --text-file reading.txt -o words.json",),
    "words segment": ("words segment reading.wav --text-file reading.txt -o words.json",),
    "words check": ("words check words.json reading.wav -o look.html --textgrid edit.TextGrid",),
    "words take": ("words take edit.TextGrid --before words.json -o checked.json",),
}
