"""Text for synthetic speech: words strung together, letters, digits, and lip-heavy phrases.

Drawn from the word lists of the system (Debian's wamerican, wngerman, …), so no text of
anybody's is needed; phones follow the language, which is all that the encoder learns from.
"""

# ruff: noqa: SIM905 - words read better as text
from __future__ import annotations

import random
from pathlib import Path

WORD_LISTS = {
    "en": "american-english",
    "de": "ngerman",
    "nl": "dutch",
    "fr": "french",
    "es": "spanish",
    "it": "italian",
    "pl": "polish",
    "sv": "swedish",
    "pt": "brazilian",
}
RUSSIAN = Path("/usr/share/hunspell/ru_RU.dic")  # WORD/FLAGS a line, in UTF-8
# Where no word list is at hand, words are made of what is written for a syllable.
KANA = (
    "あいうえおかきくけこさしすせそたちつてとなにぬねのはひふへほまみむめもやゆよらりるれろわん"
    "がぎぐげごばびぶべぼぱぴぷぺぽ"
)
MADE_WORDS = 4000
LITTLE_WORDS = {
    "en": "the a of to and in that it is was i for on you he be with as by at have are this not "
    "but had his they from she which or we an there were one do been all their has would will "
    "what if can when so no my me please put give take go come make see look up now again".split(),
    "de": "der die das und ist in zu den nicht von mit sich des auf für ein eine dem so wie aber "
    "wir haben bei um am über noch vor bitte".split(),
    "nl": "de het een en van in is op te dat die voor met niet zijn aan er om ook als bij maar "
    "wij hebben over nog graag".split(),
}
NAMES_OF_THINGS = (
    "zero one two three four five six seven eight nine ten eleven twelve twenty thirty hundred "
    "red green white black brown yellow purple pink monday tuesday friday sunday january "
    "february april may june left right up down stop start open close play pause"
).split()
LETTERS = "a b c d e f g h i j k l m n o p q r s t u v w x y z".split()
SHARE_OF_LISTS = 0.15  # utterances of letters, digits and names


def words_of(language: str) -> list[str]:
    """Plain lower-case words of 2 to 11 letters; `cm` is Mandarin, as espeak-ng names it."""
    if language in ("ja", "cm"):
        return _made_words(KANA if language == "ja" else _frequent_hanzi())
    if language == "ru":
        entries = RUSSIAN.read_text(encoding="utf-8").splitlines()[1:]
        lines = [entry.partition("/")[0] for entry in entries]
    else:
        path = Path("/usr/share/dict") / WORD_LISTS[language]
        lines = path.read_text(encoding="utf-8", errors="ignore").splitlines()
    return sorted({w.lower() for w in lines if w.isalpha() and 2 <= len(w) <= 11})


def _frequent_hanzi() -> str:
    """The first level of GB 2312: 3,755 characters in daily use."""
    codes = (bytes((row, cell)) for row in range(0xB0, 0xD8) for cell in range(0xA1, 0xFF))
    return "".join(code.decode("gb2312", errors="ignore") for code in codes)


def _made_words(syllables: str) -> list[str]:
    draw = random.Random(0)
    return ["".join(draw.choices(syllables, k=draw.randint(1, 4))) for _ in range(MADE_WORDS)]


def sentence(language: str, words: list[str], draw: random.Random) -> str:
    """One utterance of 1 to 14 words."""
    if language == "en" and draw.random() < SHARE_OF_LISTS:
        pool = draw.choice([LETTERS, NAMES_OF_THINGS, LETTERS + NAMES_OF_THINGS])
        return " ".join(draw.choice(pool) for _ in range(draw.randint(1, 8)))
    little = LITTLE_WORDS.get(language)
    picked = []
    for _ in range(draw.choice([1, 2, 3, 5, 6, 7, 8, 9, 10, 12, 14])):
        pool = little if little and draw.random() < 0.35 else words
        picked.append(draw.choice(pool))
        if draw.random() < 0.06:
            picked[-1] += ","
    return " ".join(picked).rstrip(",")
