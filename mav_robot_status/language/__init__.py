"""The language of state: a word, shape and tone for each value, a state and a headline for each status, and remedies.

Page, board, terminal, report, events and ground stations show what this package says. It reads the members of a JSON
line, so that a status from a broker or a log has the same words as a live one.
"""

from .headline import Headline, Sentence, headline
from .remedies import Remedy, remedy, spoken
from .states import ROBOT_STATES, State, Trouble, state_of, troubles
from .unknown import next_step, same_step
from .values import LINK, LOOKS, TONES, Look, Tone, look, style_sheet

__all__ = [
    "LINK",
    "LOOKS",
    "ROBOT_STATES",
    "TONES",
    "Headline",
    "Look",
    "Remedy",
    "Sentence",
    "State",
    "Tone",
    "Trouble",
    "headline",
    "look",
    "next_step",
    "remedy",
    "same_step",
    "spoken",
    "state_of",
    "style_sheet",
    "troubles",
]
