"""Options that several commands share."""

from __future__ import annotations

import typer

from elocute.articulation.settings import AnimationSettings
from elocute.cli.settings_options import option
from elocute.numerics.frame_rates import frame_rate
from elocute.settings import SEED_MAX

Fps = option(AnimationSettings, "fps")
Strength = option(AnimationSettings, "strength")
Contacts = option(AnimationSettings, "contacts")
ContactsOff = option(AnimationSettings, "contacts", default="off")
LearningSeed = typer.Option(0, min=0, max=SEED_MAX, help="Seed of the learned methods.")
Output = typer.Option(
    ...,
    "-o",
    "--output",
    help="Where to write; the suffix chooses the format. Can be repeated.",
)
Channel = typer.Option(
    None,
    "--channel",
    help="Use this channel, counted from 0, instead of the mix of all channels.",
)
Resampled = typer.Option(
    None, "--fps", help="Resample to this frame rate.", parser=frame_rate, metavar="RATE"
)
Track = typer.Option(
    None,
    "--track",
    help="Use this audio track of a file with several, counted from 0; `elocute info` lists them.",
)
Partial = typer.Option(False, "--partial", help="Take a sound that was cut off as far as it goes.")
Overwrite = typer.Option(False, "--overwrite", help="Replace files that exist already.")
NoClobber = typer.Option(False, "--no-clobber", help="Keep files that exist already, and say so.")
Identity = typer.Option(
    "mean", "--identity", help="Identity of the face: a name, a seed, or a .json file."
)
StyleName = typer.Option(
    "plain", "--style", help="Speaking style: a name, a mix (calm:0.7,broad:0.3), or a .json file."
)
Life = typer.Option(
    "1",
    "--life",
    help="How much moves beside the mouth, made from the sound: 0 to 1, or parts of it (head, "
    "brows, blinks, gaze, breath, cheeks, asymmetry), as in 0.6 or head=0.5,blinks=0.",
)
Mood = typer.Option(
    "neutral",
    "--mood",
    help="How the person feels: neutral, happy, sad, angry, surprised or tender, with an "
    "intensity or without (happy:0.6); auto: calm, lively or forceful, as the voice is.",
)
TakeSeed = option(AnimationSettings, "seed")
Listen = typer.Option(
    False,
    "--listen",
    help="The sound is a partner's: the face listens (looks at them, nods where their phrases end) "
    "and its lips rest.",
)
Look = typer.Option(
    "auto",
    "--look",
    help="What pictures, pages and .glb dress the head in: auto (the look of the identity), none, "
    "a person's name, a seed; with parts changed, as in otto,age=50,tone=0.6.",
)
Hair = typer.Option(None, "--hair", help="Hair of the look: swept, crop, long, ponytail, …, none.")
HairColour = typer.Option(None, "--hair-colour", help="Its colour: black, brown, blond, grey, …")
Eyes = typer.Option(None, "--eyes", help="Irises of the look: brown, blue, green, grey, …")
Brows = typer.Option(None, "--brows", help="Brows of the look: soft, straight, full, …, none.")
Clothes = typer.Option(None, "--clothes", help="Clothes of the look: crew, roll, collar, none.")
ClothesColour = typer.Option(
    None, "--clothes-colour", help="Their colour: white, grey, black, navy, teal, rust, …"
)
Edits = typer.Option(
    None,
    "--edits",
    help="Edit list (.json): amplitudes, styles, moods, keys, closed lips and more over time, "
    "applied after the model.",
)
Jobs = typer.Option(
    1, help="Number of processes for a table or many recordings; 0 takes all processors."
)
Ray = typer.Option(
    None,
    "--ray",
    help="Run on a Ray cluster at HOST:PORT, or on a node of its own (local); --jobs is then the "
    "number of workers, 1 for all.",
)
Mix = option(AnimationSettings, "mix")
Model = typer.Option(
    "talkers",
    "--model",
    help="Speech model: talkers (the rules, corrected by what many people do), articulation (the "
    "rules alone), voca, crnn, or a trained model (.onnx).",
)
Head = typer.Option(
    "builtin",
    "--head",
    help="Head to animate: builtin, a character with shapes of its own (.glb, .gltf, .vrm, "
    ".fbx), a FLAME model (.pkl), or a head or mesh file in the topology of the model.",
)
Mesh = typer.Option(
    None, "--mesh", help="Name of a mesh of the head, where a character's file has several heads."
)
Split = typer.Option("default", help="Name of the split of the corpus.")
Table = typer.Option(
    None, "--table", help="Also write the table to this file (.csv or .tex). Can be repeated."
)
OverwriteTable = typer.Option(False, "--overwrite", help="Replace existing tables.")
KeepTable = typer.Option(
    False, "--no-clobber", help="Leave existing tables as they are, and say so."
)
Json = typer.Option(False, "--json", help="Print the result as one JSON record.")
