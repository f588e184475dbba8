"""Words and sentences that voices say: settings are tuned on some, figures come from others."""

# ruff: noqa: SIM905 - words read better as text
from __future__ import annotations

TUNING_WORDS = (
    "ability allow because century decision energy forward german himself itself major numbers "
    "office parents question rather september through visit without"
).split()
WORDS = (
    "about absolutely access across action actually affairs afternoon against agreement ahead "
    "almost already although america amount announced another answer around attack authorities "
    "banks before behind benefit better between billion border brought budget building business "
    "called capital central challenge change charges children claims coming common community "
    "company concerns conflict control council country couple course court crisis current david "
    "deficit despite development difference dollars during economy education election emergency "
    "england europe evening evidence example expected families figures football foreign friday "
    "further general germany giving global government growing happened health hospital hours "
    "human important industry information inside issues justice labour leaders level little "
    "local london longer majority market medical member message middle million minister minutes "
    "monday moment months morning national needs"
).split()
FRAMES = (
    "we said {} to them again",
    "they will ask for {} in the spring",
    "now {} is on the list",
    "you heard the word {} today",
    "tell me why {} came first",
    "one more thing is {} here",
    "please write down {} for us",
    "it was {} that she meant",
    "there is no {} without a price",
    "all of it was about {} then",
)
