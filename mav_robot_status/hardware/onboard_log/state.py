"""What an onboard log has said up to a moment: the last word on each matter, with the record that said it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface import Evidence, RobotMode, TriState, Vehicle
from ..mavlink.faults import causes
from ..mavlink.motion.state import Motion

if TYPE_CHECKING:
    from collections.abc import Iterable

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

READINESS_HOLDS: Final = 35.0
"""Seconds for which a reason against arming counts: ArduPilot repeats it every 30 s."""
REFUSAL_HOLDS: Final = 10.0
"""Seconds for which the refusal of one attempt to arm counts."""
DISARMED_FOR: Final = 5.0
"""Seconds after a disarm at which a failsafe ends that nothing has cleared."""
HOLDS: Final = 10.0
"""Seconds for which an error counts that has no end of its own."""
MOST_TEXTS: Final = 16


class Told(NamedTuple):
    """What a record said."""

    value: TriState
    rule: str
    """In words."""
    source: str | None = None
    """The record with its member: `ARM.Method 12`."""
    at: float = -math.inf
    """When, in seconds of the replay."""

    def evidence(self) -> Evidence:
        """As the evidence of a field."""
        return Evidence(self.rule, self.source, None if self.at == -math.inf else self.at)


class Mode(NamedTuple):
    """The flight mode."""

    mode: RobotMode = RobotMode.UNKNOWN
    name: str | None = None
    number: int | None = None
    why: str = "no record of the mode"
    source: str | None = None
    at: float = -math.inf


NO_ARMED: Final = Told(UNKNOWN, "no record says whether it is armed")
NO_STOP: Final = Told(UNKNOWN, "no record shows the emergency stop")
NO_SAFETY: Final = Told(UNKNOWN, "no record of the safety switch")
NO_LANDED: Final = Told(UNKNOWN, "no record shows whether it is landed")
NO_REST: Final = Told(UNKNOWN, "no record shows rest")
NO_OUTPUTS: Final = Told(UNKNOWN, "no record of the motor outputs")
NO_CHECKS: Final = Told(UNKNOWN, "no record of the arming checks")
NO_MODE: Final = Mode()
"""Before a record says it."""


@dataclass(slots=True)
class Active:
    """An error that is active."""

    text: str | None
    since_us: int
    at: float
    """When it was last said."""
    record: bool = False
    """Whether a record raised it that also ends it. Else its own rule ends it."""


@dataclass(slots=True)
class LogState:
    """The last words. Each record changes it in place."""

    vehicle: Vehicle
    system: int | None = None
    component: int = 1
    family: str = ""
    """`copter`, `plane`, `rover`, `sub`, ...: the name of a family of `hardware.mavlink.identity`."""
    aircraft: bool = False
    armed: Told = NO_ARMED
    stop: Told = NO_STOP
    safety: Told = NO_SAFETY
    """TRUE: it holds the outputs."""
    landed: Told = NO_LANDED
    rests: Told = NO_REST
    """Whether the autopilot finds that it is at rest, by its sensors of acceleration."""
    driven: Told = NO_OUTPUTS
    outputs_at: float = -math.inf
    """When the motor outputs were last seen."""
    live: bool = False
    """Whether a periodic record says armed although the last event says disarmed."""
    testing: bool = False
    """Whether a motor test runs: between two motors none is driven."""
    ready: Told = NO_CHECKS
    mode: Mode = NO_MODE
    initialising: bool = False
    hil: bool = False
    terminated: str | None = None
    """Why the flight is terminated."""
    motion: Motion = field(default_factory=Motion)
    rotation: float = 0.0
    """rad/s."""
    motion_from: str | None = None
    """The record that gives the speed."""
    reasons: dict[str, tuple[int, float]] = field(default_factory=dict)
    """The reasons against arming, with since when (UTC, us) and when last said."""
    active: dict[int, Active] = field(default_factory=dict)
    """Errors by their codes."""
    shows_errors: bool = False
    """Whether the log holds the records that show errors."""

    def raise_error(
        self, codes: Iterable[int], text: str | None, unix_us: int, at: float, record: bool = False
    ) -> None:
        """Causes become active."""
        for code in codes:
            worse = causes.CAUSES[code].worse
            if worse is not None and worse in self.active:
                continue
            known = self.active.get(code)
            if known is None:
                self.active[code] = Active(text, unix_us, at, record)
            else:
                known.text, known.at, known.record = text or known.text, at, known.record or record

    def clear(self, codes: Iterable[int]) -> None:
        """Causes end."""
        for code in codes:
            self.active.pop(code, None)

    def against_arming(self, text: str, unix_us: int, at: float) -> None:
        """A reason why it cannot be armed."""
        since = self.reasons.pop(text, (unix_us, at))[0]
        self.reasons[text] = since, at
        while len(self.reasons) > MOST_TEXTS:
            del self.reasons[next(iter(self.reasons))]

    def passes_again(self, part: str) -> None:
        """A part is healthy again: reasons against arming that name it end."""
        for text in [text for text in self.reasons if part in text]:
            del self.reasons[text]

    def set_armed(self, told: Told) -> None:
        """It is armed or disarmed. Errors and reasons of before end."""
        if told.value is TRUE and self.armed.value is not TRUE:
            self.reasons.clear()
            self.clear([c for c in self.active if causes.CAUSES[c].clears is causes.Clears.ARMING])
        if told.value is not self.armed.value:
            self.armed = told

    def ends(self, code: int) -> float:
        """When an error ends by itself, in seconds of the replay."""
        one, cause = self.active[code], causes.CAUSES[code]
        if one.record or cause.clears is causes.Clears.REBOOT:
            return math.inf
        if cause.clears is causes.Clears.FAILSAFE:
            return max(one.at, self.armed.at) + DISARMED_FOR if self.armed.value is FALSE else math.inf
        if cause.clears is causes.Clears.ARMING and cause.hold is None:
            return math.inf
        return one.at + (cause.hold or HOLDS)

    def expire(self, now: float) -> None:
        """Drop what ended by itself."""
        self.clear([code for code in self.active if now >= self.ends(code)])
        for text in [text for text, (_, at) in self.reasons.items() if now >= at + _holds(text)]:
            del self.reasons[text]

    def next_end(self, now: float) -> float:
        """When something ends by itself."""
        ends = [self.ends(code) for code in self.active]
        ends += [at + _holds(text) for text, (_, at) in self.reasons.items()]
        motion = self.motion
        ends += [] if motion.fast_since is None else [motion.fast_since + 0.3]
        ends += [] if motion.slow_since is None else [motion.slow_since + 1.0]
        return min((end for end in ends if end > now), default=math.inf)

    def doubt(self) -> None:
        """Records are missing here: what says that it is safe is not known any more."""
        gone = "what was last said is from before a gap in the log"
        if self.armed.value is FALSE:
            self.armed = Told(UNKNOWN, gone)
        if self.stop.value is TRUE:
            self.stop = Told(UNKNOWN, gone)
        if self.safety.value is TRUE:
            self.safety = Told(UNKNOWN, gone)
        self.landed, self.rests, self.driven = (Told(UNKNOWN, gone),) * 3
        self.motion, self.testing, self.live = Motion(), False, False


def _holds(text: str) -> float:
    """How long a reason against arming counts, seconds."""
    return REFUSAL_HOLDS if text.startswith(("Arm: ", "Arming denied")) else READINESS_HOLDS
