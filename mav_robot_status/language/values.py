"""The look of each value of each field: a word, a shape and a tone. This is the only table of them.

A parked, healthy robot is calm. Colour is for what a person must know: it may move (active), it needs a look (warning),
it is stopped or in error (alarm), nobody knows (unknown). The shape and the word say the same without colour.
"""

from __future__ import annotations

from typing import Any, Final, Literal, NamedTuple

from ..interface import STATES, Field, Kind

Tone = Literal["calm", "active", "warning", "alarm", "unknown"]


class Colours(NamedTuple):
    """The colours of a tone. People who see fewer colours can tell them apart. The contrast is at least 4.5."""

    light: str
    """As text on white, `#rrggbb`."""
    dark: str
    """As text on #14181d."""
    terminal: str
    """The style in a terminal, in rich's words; from the palette of the terminal."""
    meaning: str


TONES: Final[dict[Tone, Colours]] = {
    "calm": Colours("#3d4650", "#c3cad2", "", "Nothing that a person must know."),
    "active": Colours("#00558c", "#7cc0f5", "bold cyan", "It moves, or it can: keep clear."),
    "warning": Colours("#8a5300", "#f0b14a", "bold yellow", "It needs a look."),
    "alarm": Colours("#b3261e", "#ff9d94", "bold white on red", "It is stopped, or in error."),
    "unknown": Colours("#5c5470", "#b9b0cf", "magenta", "Nobody knows: it may move."),
}


class Look(NamedTuple):
    """How a value looks."""

    word: str
    shape: str
    """The name of a drawing on the page: `stop`. No two values of a field have the same."""
    glyph: str
    """The same in a terminal, one cell wide."""
    ascii: str
    """The same in a terminal without UTF-8."""
    tone: Tone
    short: str = ""
    """The word in at most five letters, for narrow columns; empty: the word is short."""
    bar: str = "hatched"
    """Its form in a timeline: `full`, `half`, `line` or `hatched`."""


UNKNOWN: Final = Look("unknown", "unknown", "?", "?", "unknown", "unk")
YES: Final = Look("YES", "dot", "●", "*", "calm", bar="full")
NO: Final = Look("no", "ring", "○", "o", "calm", bar="line")

LINK: Final = "link"
"""The name of the link among the fields of LOOKS."""

LOOKS: Final[dict[str, dict[Any, Look]]] = {
    "mode": {
        "AUTO": Look("AUTO", "auto", "»", "A", "calm", bar="full"),
        "MANUAL": Look("MANUAL", "manual", "☺", "M", "calm", "MAN", bar="half"),
        "UNKNOWN": UNKNOWN,
    },
    "motion_possible": {
        True: Look("CAN MOVE", "dot", "●", "*", "active", "YES", bar="full"),
        False: Look("cannot move", "ring", "○", "o", "calm", "no", bar="line"),
        None: UNKNOWN,
    },
    "in_motion": {
        True: Look("MOVING", "move", "▶", ">", "active", "MOVE", bar="full"),
        False: Look("still", "still", "▫", ".", "calm", "no", bar="line"),
        None: UNKNOWN,
    },
    "drives_powered": {
        True: Look("POWERED", "power", "↯", "~", "active", "ON", bar="full"),
        False: Look("off", "ring", "○", "o", "calm", bar="line"),
        None: UNKNOWN,
    },
    "e_stopped": {
        True: Look("STOPPED", "stop", "■", "#", "alarm", "STOP", bar="full"),
        False: Look("released", "ring", "○", "o", "calm", "no", bar="line"),
        None: UNKNOWN,
    },
    "in_error": {
        True: Look("ERROR", "fault", "◆", "!", "alarm", "ERR", bar="full"),
        False: Look("none", "ring", "○", "o", "calm", "no", bar="line"),
        None: UNKNOWN,
    },
    LINK: {
        "CONNECTED": Look("connected", "bars", "≡", "=", "calm", "heard", bar="line"),
        "LOST": Look("LOST", "lost", "✗", "x", "warning", bar="full"),
        "NEVER_SEEN": Look("not heard", "unheard", "◌", ":", "unknown", "none"),
    },
}
"""Every value that JSON lines can have, by field. A field without a row has the words of `_plain`."""

MODES: Final = {"AUTO": YES, "MANUAL": NO, "UNKNOWN": UNKNOWN}


def _plain(field: Field) -> dict[Any, Look]:
    """The looks of a field that has none of its own."""
    return dict(MODES) if field.kind is Kind.MODE else {True: YES, False: NO, None: UNKNOWN}


for _field in STATES:
    LOOKS.setdefault(_field.name, _plain(_field))


def look(field: str, value: object) -> Look:
    """The look of a value. A value that the table lacks is unknown."""
    known = LOOKS.get(field, {})
    return known.get(value, UNKNOWN) if isinstance(value, (str, bool, type(None))) else UNKNOWN


def style_sheet() -> str:
    """The colours of the tones as CSS: a property of the page for each tone, `--tone` for the elements of its class.

    Paper is light.
    """
    light = " ".join(f"--{name}: {tone.light};" for name, tone in TONES.items())
    dark = " ".join(f"--{name}: {tone.dark};" for name, tone in TONES.items())
    classes = "\n".join(f".{name} {{ --tone: var(--{name}); }}" for name in TONES)
    return f":root {{ {light} }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}\n{classes}\n"
