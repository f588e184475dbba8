"""Mouths that speak eight languages, judged by the phone times of the synthesiser.

    python -m benchmarks.languages
    python -m benchmarks.languages --data DATA

espeak-ng speaks sentences of each language in two voices and tells when it says which phone. With
`--data`, the folder of recordings that benchmarks.encoder takes, also a natural German voice with
forced alignment, in clips evenly taken. Needs espeak-ng with its library.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from elocute.animation import animate
from elocute.audio.waveform import Waveform
from elocute.encoders.phones_and_visemes import PHONES
from elocute.evaluation.phone_mouth_scores import (
    PhoneMouthScore,
    SpokenTake,
    phone_mouth_score,
)
from elocute.speech.times.labels import Label
from recipes.encoder.reference import read_reference
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Espeak

FPS = 60.0
LEAD_S, TAIL_S = 0.6, 1.0  # of faint noise around the words: mouths rest too
VARIANTS = (("", 150, 45), ("+f2", 175, 60))  # voice, words per minute, pitch
REFERENCE = Path(__file__).with_name("encoder_reference.json")
NATURAL_CLIPS = 40
WAYS = (
    ("exact", "articulation", "auto"),
    ("rules", "articulation", "auto"),
    ("exact", "talkers", "auto"),
    ("talkers", "talkers", "auto"),
    ("voca", "voca", "off"),
    ("voca", "voca", "auto"),
    ("crnn", "crnn", "off"),
    ("crnn", "crnn", "auto"),
)
SENTENCES = {
    "German": (
        "de",
        "Mein Bruder Peter möchte fünf frische Pflaumen und viel Butter kaufen.",
        "Am Abend haben wir im Park gebadet, dann kam plötzlich ein Wolf vorbei.",
        "Über sieben Brücken musst du gehen, bevor du schöne Blumen findest.",
        "Die Familie liebt Fisch mit Pommes, aber Opa probiert nur Gemüsesuppe.",
        "Wieviel Uhr ist es, bitte? Um vier Uhr fährt der Bus zum Bahnhof.",
        "Süße Früchte blühen früh im Frühling, böse Vögel picken am Baum.",
    ),
    "French": (
        "fr",
        "Papa veut beaucoup de pommes et un peu de beurre pour faire du pain.",
        "Mon petit frère vient de voir un film fabuleux avec ses amis.",
        "La lune brille, une femme boit du vin et parle de son jeune bébé.",
        "Vous pouvez prendre le bus numéro deux, puis tourner à gauche.",
        "Il fait beau aujourd'hui, nous allons à la plage avec maman.",
        "Combien de fromage voulez-vous, monsieur? Un morceau pas trop mûr.",
    ),
    "Spanish": (
        "es",
        "Pablo bebe mucho vino y habla poco por la mañana.",
        "Mi familia prefiere pasar el fin de semana en un pueblo pequeño.",
        "El médico me compró un buen libro y una bufanda verde.",
        "¿Puedes explicar por qué el barco blanco no tiene bandera?",
        "Mamá prepara una sopa fabulosa con pimientos, tomates y un poco de pan.",
        "El bombero subió al edificio y bajó a un bebé muy feliz.",
    ),
    "Russian": (
        "ru",
        "Мой брат Павел купил белую бумагу и пять больших яблок.",
        "Бабушка любит варить вкусный борщ и печь пироги.",
        "Вы можете повторить, пожалуйста? Я не понимаю вопрос.",
        "Мама мыла раму, папа поймал рыбу, а мы играли на флейте.",
        "Утром в городе было тихо, и только голуби ходили по площади.",
        "Фёдор и его подруга вышли в море на новом пароходе.",
    ),
    "Japanese": (
        "ja",
        "ぼくは まいばん パンと みそしるを たべます。",
        "ともだちと いっしょに うみで およぐ つもりです。",
        "ふゆの あさは とても さむいので ぼうしを かぶります。",
        "おばあさんは ももを みっつ かって、ぶどうも えらびました。",
        "すみません、びじゅつかんは どこに ありますか。",
        "えきまえの ひろばで こどもたちが あそんでいます。",
    ),
    "Mandarin": (
        "cmn-latn-pinyin",
        "ba4 ba5 ming2 tian1 mai3 ba1 ge4 ping2 guo3 he2 pu2 tao5",
        "wo3 de5 peng2 you3 fei1 chang2 xi3 huan1 bei3 jing1",
        "ma1 ma5 zuo4 de5 mian4 bao1 bi3 fan4 guan3 de5 hao3 chi1",
        "qing3 wen4, fu4 jin4 you3 mei2 you3 bian4 li4 dian4",
        "xia4 yu3 de5 shi2 hou5, mao1 pao3 jin4 le5 fang2 zi5",
        "di4 di5 mei3 tian1 wan3 shang5 bu4 kan4 bao4 zhi3",
    ),
    "Polish": (
        "pl",
        "Babcia piecze pyszny placek i pije wodę z bąbelkami.",
        "Mój brat bardzo lubi filmy, a moja mama woli muzykę poważną.",
        "Proszę podać mi pół bochenka chleba i trochę masła.",
        "W piątek wieczorem pojechaliśmy pociągiem nad morze.",
        "Ptaki śpiewają w parku, a ryby pływają w rzece.",
        "Fabryka mebli w tym mieście zatrudnia prawie pięciuset pracowników.",
    ),
    "Arabic": (
        "ar",
        "ذَهَبَ أَحْمَدُ إِلَى الْمَكْتَبَةِ وَفَتَحَ الْبَابَ الْكَبِيرَ",
        "يُحِبُّ مُحَمَّدٌ أَنْ يَشْرَبَ الْحَلِيبَ فِي الصَّبَاحِ",
        "بَيْتُنَا جَمِيلٌ وَفِيهِ غُرْفَةُ نَوْمٍ وَمَطْبَخٌ",
        "سَافَرَ أَبِي إِلَى مِصْرَ فِي فَصْلِ الصَّيْفِ",
        "الْمُعَلِّمُ يَكْتُبُ الدَّرْسَ، وَالتَّلَامِيذُ يَفْهَمُونَ",
        "مَرْحَبًا بِكُمْ فِي مَدِينَتِنَا، تَفَضَّلُوا مَعَ الْبِنْتِ",
    ),
}


def spoken(
    engine: Espeak, language: str, sentences: int | None = None
) -> Iterator[tuple[Waveform, Sequence[Label], list[tuple[float, float, str]]]]:
    """Sound, IPA phones and ARPAbet phones of a language's sentences, each in two voices."""
    voice, *texts = SENTENCES[language]
    noise = np.random.default_rng(0)
    for text in texts[:sentences]:
        for variant, words_per_minute, pitch in VARIANTS:
            samples, phones = engine.speak(text, voice + variant, words_per_minute, pitch, 50)
            ipa = _shifted(_ipa(engine, len(samples) / RATE))
            sound = np.concatenate(
                [
                    noise.normal(0, 2e-4, round(LEAD_S * RATE)),
                    samples,
                    noise.normal(0, 2e-4, round(TAIL_S * RATE)),
                ]
            )
            yield Waveform(sound.astype(np.float32), RATE), ipa, _shifted(phones)


def _ipa(engine: Espeak, seconds: float) -> list[tuple[float, float, str]]:
    """The phones that espeak-ng said last; signs that prolong the one before belong to it."""
    said = engine.said
    starts = [sample / said.sample_rate for sample, _ in said.phones] + [seconds]
    phones: list[tuple[float, float, str]] = []
    for place, (_, symbol) in enumerate(said.phones):
        start, end = starts[place], starts[place + 1]
        if phones and symbol.strip() and not any(letter.isalpha() for letter in _bare(symbol)):
            phones[-1] = (phones[-1][0], end, phones[-1][2])
        else:
            phones.append((start, end, symbol))
    return phones


def _bare(symbol: str) -> str:
    """Without the letters that only modify: ʲ, ʰ and the like."""
    return "".join(letter for letter in symbol if letter not in "ʲʰˠˤˀːˑ")


def _shifted(phones: list[tuple[float, float, str]]) -> list[tuple[float, float, str]]:
    return [(start + LEAD_S, end + LEAD_S, phone) for start, end, phone in phones]


def natural_german(
    data: Path, clips: int = NATURAL_CLIPS
) -> Iterator[tuple[Waveform, Sequence[Label], list[tuple[float, float, str]]]]:
    """A natural German voice with forced alignment to 20 ms, evenly taken clips."""
    utterances = [one for one in read_reference(REFERENCE, data / "speech") if one.language == "de"]
    for one in utterances[:: max(1, len(utterances) // clips)][:clips]:
        edges = np.flatnonzero(np.diff(one.labels)) + 1
        starts = [0, *edges.tolist()]
        stops = [*edges.tolist(), len(one.labels)]
        phones = [
            (a / 50, b / 50, PHONES[one.labels[a]]) for a, b in zip(starts, stops, strict=True)
        ]
        yield Waveform(one.samples, RATE), phones, phones


def score(
    speech: Sequence[tuple[Waveform, Sequence[Label], list[tuple[float, float, str]]]],
    way: tuple[str, str, str],
) -> PhoneMouthScore:
    """One model, one way, on the sounds of one language."""

    def takes() -> Iterator[SpokenTake]:
        label, model, contacts = way
        for sound, phones, arpabet in speech:
            exact = animate(sound, phones=arpabet, model="articulation", fps=FPS, life=0).motion
            known = arpabet if label == "exact" else None
            moved = animate(
                sound, phones=known, model=model, contacts=contacts, fps=FPS, life=0
            ).motion
            yield SpokenTake(moved, phones, exact)

    return phone_mouth_score(takes())


def row(language: str, way: tuple[str, str, str], found: PhoneMouthScore) -> str:
    """A row of the table in docs/measurements/voca.md."""
    lips, teeth = found.closures, found.labiodentals
    label, model, contacts = way
    name = "rules" if model == "articulation" else f"`{model}`"
    if label == "exact":
        name += ", exact phone times"
    elif model != "articulation":
        name += ", bare" if contacts == "off" else ", finished"
    return (
        f"| {language} | {name} | {lips.met}, {lips.made - lips.right}, {lips.wanted - lips.met} "
        f"| {lips.recall:.2f} | {lips.precision:.2f} | {teeth.recall:.2f} | {teeth.precision:.2f} "
        f"| {found.narrowing_mm:.1f} | {found.protrusion_mm:.1f} | {found.rounding_told:.2f} "
        f"| {found.opening_r:.2f} | {found.rest:.2f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, help="folder of recordings, for natural German")
    parser.add_argument("--language", action="append", choices=[*SENTENCES], help="only this one")
    arguments = parser.parse_args()
    engine = Espeak()
    for language in arguments.language or SENTENCES:
        speech = list(spoken(engine, language))
        for way in WAYS:
            print(row(language, way, score(speech, way)), flush=True)
    if arguments.data:
        speech = list(natural_german(arguments.data))
        for way in WAYS:
            print(row("German, a natural voice", way, score(speech, way)), flush=True)


if __name__ == "__main__":
    main()
