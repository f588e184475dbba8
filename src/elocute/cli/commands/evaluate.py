"""`elocute evaluate`: speech models and alignments measured."""

from __future__ import annotations

from elocute.cli.command_group import CommandGroup
from elocute.cli.commands import (
    evaluate_alignment,
    evaluate_benchmark,
    evaluate_corpus,
    evaluate_features,
    evaluate_mouth,
    evaluate_noise,
    evaluate_real,
    evaluate_wild,
)

app = CommandGroup("Evaluate speech models, and alignments of recordings.")
app.command("alignment")(evaluate_alignment.alignment_command)
app.command("benchmark")(evaluate_benchmark.benchmark_command)
app.command("corpus")(evaluate_corpus.corpus_command)
app.command("features")(evaluate_features.features_command)
app.command("wild")(evaluate_wild.wild_command)
app.command("real")(evaluate_real.real_command)
app.command("noise")(evaluate_noise.noise_command)
app.command("styles")(evaluate_mouth.styles_command)
app.command("identities")(evaluate_mouth.identities_command)
