"""Why an autopilot cannot be armed: the reasons that its pre-arm checks report in texts.

ArduPilot (AP_Arming, 4.5.6 and 4.7-dev) runs all its checks, and sends one text for each that fails: a burst. It sends
"PreArm: ..." when the checks begin to fail, every 30 s while disarmed, and after MAV_CMD_RUN_PREARM_CHECKS. It sends
"Arm: ..." after an attempt to arm. An attempt runs the same checks first and further ones only if these pass, so each
burst names every failing pre-arm check, with either prefix. A reason is known by its words without the prefix.

A text is sent once and may be lost. What a burst lacks is therefore judged with care:

- It repeats other reasons: the missing text may be lost. Its reason ends with the second such burst in a row.
- It repeats none: the checks that failed before pass, and others fail. All older reasons end.
- There is no burst: nothing ends, until a reason is older than three periods of 30 s.

The cost is a reason that is listed for one period too long. A reason whose text gets lost twice in a row is missing
until its next text. Arming, a reboot, and a SYS_STATUS with passing checks end all reasons; the handlers do this.

An autopilot that does not report its checks in bursts (PX4) has one reason: its latest text.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from ....clock import Instant

BURST: Final = 1.0
"""Seconds without a text of the checks after which a burst is over."""
LASTS: Final = 95.0
"""Seconds after its latest text for which a reason of a burst holds: three periods, and a delay of the link."""
MOST: Final = 16
"""Limit of reasons. When one more arrives, the one that was not repeated for the longest time gives way."""
MEASURED: Final = re.compile(r"\d+\.\d+|\d\d+")
"""A measured value in a text. One digit is the number of a part: "GPS 1: Bad fix"."""


class Reason(NamedTuple):
    """A reason why the vehicle cannot be armed."""

    text: str
    since: Instant
    last: float
    """Monotonic seconds of the latest text, as in all fields below."""
    until: float
    """When it ends without a further text."""
    missed: int = 0
    """The number of bursts in a row that lacked it."""


class Readiness(NamedTuple):
    """The reasons, and the burst that is not over."""

    reasons: Mapping[str, Reason] = {}
    """In order of the first text, by the words without the prefix."""
    first: float = math.inf
    """When the burst began; inf: none is open."""
    last: float = -math.inf
    """When its latest text arrived."""


NOTHING: Final = Readiness()


def alone(before: Readiness, text: str, now: Instant) -> Readiness:
    """The one reason, after a text that replaces all before."""
    known = before.reasons.get(text)
    return Readiness({text: Reason(text, now if known is None else known.since, now.mono, math.inf)})


def reported(before: Readiness, text: str, words: str, now: Instant) -> Readiness:
    """The reasons after one more text of a burst; `words` is the text without its prefix.

    A reason that is reported again within a burst begins another one: the checks have run once more.
    """
    at = now.mono
    held = passed(before, at)
    known = _known(held, words)
    if known is not None and held.reasons[known].last >= held.first:
        held = closed(held)
    held = held._replace(first=min(held.first, at), last=at)
    since = now if known is None else held.reasons[known].since
    reason = Reason(text, since, at, at + LASTS)
    if known is None:
        return _with(held, words, reason)
    changed = {words if key == known else key: reason if key == known else r for key, r in held.reasons.items()}
    return held._replace(reasons=changed)


def passed(readiness: Readiness, now: float) -> Readiness:
    """The reasons at `now`."""
    if not readiness.reasons:
        return readiness
    if now >= readiness.last + BURST:
        readiness = closed(readiness)
    if any(now > reason.until for reason in readiness.reasons.values()):
        lasting = {key: reason for key, reason in readiness.reasons.items() if now <= reason.until}
        readiness = readiness._replace(reasons=lasting) if lasting else NOTHING
    return readiness


def _known(readiness: Readiness, words: str) -> str | None:
    """The key of the reason with these words, or with other measured values that this burst has not repeated."""
    if words in readiness.reasons:
        return words
    form = MEASURED.sub("", words)
    for key, reason in readiness.reasons.items():
        if reason.last < readiness.first and MEASURED.sub("", key) == form:
            return key
    return None


def closed(readiness: Readiness) -> Readiness:
    """The reasons after the end of the burst."""
    first = readiness.first
    if first == math.inf:
        return readiness
    repeats = any(reason.since.mono < first <= reason.last for reason in readiness.reasons.values())
    kept = {}
    for key, reason in readiness.reasons.items():
        if reason.last >= first:
            kept[key] = reason._replace(missed=0)
        elif repeats and not reason.missed:
            kept[key] = reason._replace(missed=1)
    return readiness._replace(reasons=kept, first=math.inf)


def _with(readiness: Readiness, words: str, reason: Reason) -> Readiness:
    """A new reason. A burst of more than MOST keeps the first ones."""
    reasons = dict(readiness.reasons)
    if len(reasons) >= MOST:
        oldest = min(reasons, key=lambda key: reasons[key].last)
        if reasons[oldest].last >= readiness.first:
            return readiness
        del reasons[oldest]
    reasons[words] = reason
    return readiness._replace(reasons=reasons)
