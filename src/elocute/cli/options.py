"""Options that several commands share."""

from __future__ import annotations

import typer

SEED_MAX = 2**32 - 1

Output = typer.Option(
    ...,
    "-o",
    "--output",
    help="Where to write; the suffix chooses the format. May be given several times.",
)
Overwrite = typer.Option(False, "--overwrite", help="Replace files that are there already.")
NoClobber = typer.Option(
    False, "--no-clobber", help="Leave files that are there already as they are, and say so."
)
StyleName = typer.Option(
    "plain", "--style", help="Speaking style: a name, a mix (calm:0.7,broad:0.3), or a .json file."
)
Model = typer.Option(
    "articulation",
    "--model",
    help="What drives the face: articulation, voca, crnn or an .onnx.",
)
Head = typer.Option(
    "builtin", "--head", help="builtin, or a head or mesh file in the topology of the model."
)
Split = typer.Option("default", help="Which split of the corpus.")
Table = typer.Option(
    None, "--table", help="Also write the table: .csv or .tex. May be given several times."
)
OverwriteTable = typer.Option(False, "--overwrite", help="Replace tables that are there already.")
KeepTable = typer.Option(
    False, "--no-clobber", help="Leave tables that are there already as they are, and say so."
)
Json = typer.Option(False, "--json", help="Print one JSON record for machines.")
