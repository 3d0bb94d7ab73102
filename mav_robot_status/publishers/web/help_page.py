"""`help.html`: what each cause means and what to do, by topic. Made from the tables in `language`."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Final

from ...language import LOOKS, TONES
from ...language.remedies import INITIALS, REMEDIES, SENSOR
from ...language.shapes import drawing
from ...language.states import ROBOT_STATES
from ...language.texts import TEXTS
from .looks import HEADS

if TYPE_CHECKING:
    from collections.abc import Iterator

OTHER: Final = ""
"""The topic of a cause that has none."""
SAYS: Final = "The autopilot says why: the step for its words is one of these"
NOTHING: Final = "Nobody has to act, or the autopilot says what to do."
"""The step of a cause that has none."""
PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="referrer" content="no-referrer">
<title>What to do – RobotStatus</title>
<link rel="icon" href="icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="tones.css">
<link rel="stylesheet" href="page.css">
</head>
<body class="help">
<header><a class="home" href="./">RobotStatus</a></header>
<main>
<h1>What to do</h1>
<p class="note">The status is information, not a safety function. Keep clear of a robot that may move.</p>
{parts}
</main>
</body>
</html>
"""


def help_page() -> bytes:
    """The page; the heading of a topic has the topic as its id."""
    topics = dict.fromkeys([*(row.topic for row in REMEDIES.values()), SENSOR.topic, *(row.topic for row in TEXTS)])
    ordered = [topic for topic in topics if topic != OTHER] + [OTHER]
    parts = [line for topic in ordered for line in _topic(topic)] + list(_signs())
    return PAGE.format(parts="\n".join(parts)).encode()


def _topic(topic: str) -> Iterator[str]:
    causes = [(name, row) for name, row in REMEDIES.items() if row.topic == topic]
    if topic == SENSOR.topic:
        causes.append(("SENSOR_...", SENSOR))
    texts = [row for row in TEXTS if row.topic == topic]
    if not causes and not texts:
        return
    yield f'<section><h2 id="{escape(topic or "other")}">{escape(_title(topic))}</h2><dl>'
    for name, row in causes:
        words = f"{escape(_begun(row.sentence))} <code>{escape(name)}</code>"
        yield f"<dt>{words}</dt><dd>{escape(row.step) or NOTHING}</dd>"
    if texts:
        yield f"<dt>{SAYS}</dt>"
    for step in dict.fromkeys(text.step for text in texts):
        yield f"<dd>{escape(step) or NOTHING}</dd>"
    yield "</dl></section>"


def _signs() -> Iterator[str]:
    """The states, the colours, and the words of each field."""
    yield '<section><h2 id="states">States, worst first</h2><dl>'
    for state in ROBOT_STATES:
        chip = f'<span class="chip {state.tone}">{drawing(state.shape)} {escape(state.word)}</span>'
        yield f"<dt>{chip}</dt><dd>{escape(_begun(state.meaning))}.</dd>"
    yield '</dl></section><section><h2 id="signs">Colours and words</h2><dl>'
    for name, tone in TONES.items():
        yield f'<dt class="{name}"><span class="chip {name}">{escape(name)}</span></dt><dd>{escape(tone.meaning)}</dd>'
    for field, looks in LOOKS.items():
        words = ", ".join(look.word for look in looks.values())
        title = HEADS[field][1] if field in HEADS else _title(field)
        yield f"<dt>{escape(title)}</dt><dd>{escape(words)}</dd>"
    yield "</dl></section>"


def _title(topic: str) -> str:
    words = [INITIALS.get(word, word) for word in topic.replace("_", "-").split("-") if word]
    return _begun(" ".join(words)) if words else "Other"


def _begun(text: str) -> str:
    return text[:1].upper() + text[1:]
