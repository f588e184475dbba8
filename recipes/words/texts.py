"""Five hundred common English words of our own choice, all in pocketsphinx's dictionary.

The ten digits are among them because people's recordings of those are at hand. `held_out` takes
every tenth word away for the experiment on unseen words, as long as the rest keeps its phones.
"""

# ruff: noqa: SIM905 - words read better as text
from __future__ import annotations

WORDS: tuple[str, ...] = tuple(
    """
zero one two three four five six seven eight nine
above accept action active address afraid afternoon again agree airport
alive alone along always amazing ancient angry animal another answer
anybody apart apple april around arrive artist asleep author autumn
average avoid awake away baby balance bamboo banana bargain basket
bathroom battle beach beautiful because become bedroom before begin behave
behind believe belong below beneath beside better beyond bicycle birthday
biscuit bishop bitter blanket blossom bottle bottom boundary bowl branch
brave bread breakfast breathe bridge bright bring broken brother brown
bubble bucket building burn business busy butter button buy cabbage
calendar camera candle captain careful carpet carrot carry castle catch
cellar centre certain chair champion chance change chapter charming cheap
cheese cherry chicken child chimney choose church circle city classroom
clean clever climb clothes cloud coffee collect colour comb comfort
common complete computer contain cookie copper corner correct cotton cough
count country courage cousin cover cradle cream create cricket crowd
cucumber culture curious curtain cushion customer damage dance danger daughter
december decide deep deliver describe desert diamond different difficult dinner
direct discover dish distance divide doctor dollar double dragon dream
drive during eager early earth east easy echo eleven elephant
empty engine enjoy enough entire equal escape evening every exactly
example except expect explain fabric factory failure famous farmer fashion
father favour feather february fellow fence festival fever finger finish
fire fisherman flower follow football forest forget forgive forward
fountain freedom friday friend frozen fruit funny furniture future gallery
garage garden gather gentle gift giraffe give glory golden govern
grammar grandfather grape grateful green grocery ground grow guitar habit
hammer handle happen happy harbour harvest health heaven heavy height
helmet hero history holiday honest honey hope hospital hotel house
however humble humour hundred hungry husband ignore imagine improve include
indeed inside instead invite island jacket january jealous jewel join
journey joyful judge juice jungle justice kettle keyboard kitchen kitten
knife knowledge labour ladder language laughter lawyer leather lemon lesson
letter library lighthouse linen listen little lively lonely lovely lucky
luggage machine magic manage marble march market marvel massive matter
maybe meadow measure medicine melody member memory message metal midnight
million minute mirror modern moment monday money monkey month morning
mother mountain mouse mouth movement museum music mystery napkin narrow
nation nature neighbour nephew never nobody noisy normal nothing november
number obey object observe ocean october office often olive onion
opinion orange orchard ordinary oyster package palace panic paper parade
parent partner passage patient pattern peaceful pencil pepper perfect perhaps
phone photograph piano picture pigeon pillow planet plastic pleasure pocket
poem poison polite popular possible potato powder practise precious prepare
present pretty prison problem promise proper protect proud public pudding
pumpkin puppet purple puzzle quality quarter question quickly quiet rabbit
railway rainbow rather reason receive record refuse regular remain remember
remove repair repeat rescue rhythm ribbon river robin royal rubber
safety salad sailor sample saturday sausage scatter school science season secret
several shadow shelter shoulder silver simple sister summer thunder village
""".split()
)
HELD_OUT_EVERY = 10


def held_out(phones_of: dict[str, list[str]]) -> tuple[str, ...]:
    """Words kept from training: every tenth, unless a phone would be left to nobody else."""
    left = dict(phones_of)
    chosen = []
    for word in list(phones_of)[HELD_OUT_EVERY - 1 :: HELD_OUT_EVERY]:
        others = {phone for other, phones in left.items() if other != word for phone in phones}
        if set(phones_of[word]) <= others:
            chosen.append(word)
            del left[word]
    return tuple(chosen)
