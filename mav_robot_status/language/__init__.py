"""The language of state: a word, shape and tone for each value, a headline for each status, a remedy for each cause.

Page, board, terminal and report show what this package says. It reads the members of a JSON line, so that a status from
a broker or a log has the same words as a live one.
"""

from .headline import Headline, Sentence, headline
from .remedies import Remedy, remedy, spoken
from .unknown import next_step, same_step
from .values import LINK, LOOKS, TONES, Look, Tone, look, style_sheet

__all__ = [
    "LINK",
    "LOOKS",
    "TONES",
    "Headline",
    "Look",
    "Remedy",
    "Sentence",
    "Tone",
    "headline",
    "look",
    "next_step",
    "remedy",
    "same_step",
    "spoken",
    "style_sheet",
]
