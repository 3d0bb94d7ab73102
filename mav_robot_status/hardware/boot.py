"""When the autopilot booted, from its own clock, and whether that clock has started anew.

Sources: MAVLink developer guide, routing: `SYSTEM_TIME.time_boot_ms` going back means a reboot. Any message that
carries time_boot_ms serves. A step back counts when the next sample confirms it: packets that a network repeats do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

STEP_BACK_MS: Final = 2000
STEP_BACK: Final = STEP_BACK_MS / 1000  # seconds
WRAP: Final = 1 << 32  # of a clock of 32 bits, after 49 days
HALF: Final = WRAP // 2
GRACE: Final = 10.0
"""Seconds after boot during which sensor bits raise no error."""


@dataclass(slots=True)
class Boot:
    """The autopilot's clock as last heard: a record that each sample changes in place."""

    at: float
    """Monotonic seconds of the boot; of the first heartbeat while no clock was heard."""
    clock_ms: int | None = None
    doubt_ms: int | None = None
    """A sample that lies back and waits to be confirmed."""
    shown: float | None = None
    """The boot that the last step back has shown, monotonic seconds."""
    in_turn: bool = False
    """Whether that boot was shown before, and the clock has told another one since: two autopilots take turns."""


def heard_clock(boot: Boot, time_boot_ms: int, now: float) -> bool:
    """One more sample; whether it shows a reboot."""
    booted = now - time_boot_ms / 1000
    clock_ms = boot.clock_ms
    if clock_ms is None or clock_ms < time_boot_ms < clock_ms + HALF or time_boot_ms < clock_ms - HALF:  # it wraps
        # on its way a sample is only ever held up, so the earliest boot is the truest
        if clock_ms is None or not 0 <= booted - boot.at < STEP_BACK:
            boot.at = booted
        boot.clock_ms = time_boot_ms
        boot.doubt_ms = None
        return False
    if (clock_ms - time_boot_ms) % WRAP <= STEP_BACK_MS:
        boot.doubt_ms = None
        return False
    if boot.doubt_ms is None or (time_boot_ms - boot.doubt_ms + HALF) % WRAP < HALF:
        boot.doubt_ms = time_boot_ms
        return False
    boot.in_turn = boot.shown is not None and abs(booted - boot.shown) < STEP_BACK_MS / 1000
    boot.at, boot.clock_ms, boot.doubt_ms, boot.shown = booted, time_boot_ms, None, booted
    return True
