"""When the autopilot booted, from its own clock, and whether it has rebooted.

Sources: MAVLink developer guide, routing: `SYSTEM_TIME.time_boot_ms` going back means a reboot. Any message with
time_boot_ms can be used. A step back counts when the next sample confirms it: packets repeated in reverse order do not.
A boot cannot be earlier than the last sample of the run before it: a tunnel repeated packets 4 to 6 s late (recorded).
"""

from __future__ import annotations

from typing import Final

from ....values import dataclass

STEP_BACK_MS: Final = 2000
STEP_BACK: Final = STEP_BACK_MS / 1000  # seconds
WRAP: Final = 1 << 32  # of a clock of 32 bits, after 49 days
HALF: Final = WRAP // 2
APART: Final = 10.0
"""Seconds. A link delays and repeats packets by less, so times that differ by more come from two clocks."""
REFUTED: Final = 3
"""This many unconfirmed steps back, each within APART seconds of the last, are too many for repeated packets."""
DRIFT: Final = 0.05
"""The error of a clock, as a part of its time, at most STEP_BACK: a simulation may run slower than its clock."""
GRACE: Final = 10.0
"""Seconds after boot during which sensor bits raise no error."""


@dataclass(slots=True)
class BootClock:
    """The latest sample of the autopilot's clock: a record that each sample changes in place."""

    at: float
    """Monotonic seconds of the boot; of the first heartbeat while there is no sample."""
    clock_ms: int | None = None
    doubt_ms: int | None = None
    """An earlier time that the next sample must confirm."""
    shown: float | None = None
    """The boot time after the last step back, monotonic seconds."""
    rebooted: bool = False
    """Whether the latest change is a reboot."""
    in_turn: bool = False
    """Whether the latest change shows two autopilots that alternate: a return to an earlier boot time."""
    ahead: bool = False
    """Whether the latest change is a jump ahead, by more than a slow link delays."""
    refuted: int = 0
    """Steps back in a row by more than APART that the next sample refuted."""
    refuted_at: float = 0.0
    """When the latest of them was refuted, monotonic seconds."""


def heard_clock(boot: BootClock, time_boot_ms: int, now: float) -> bool:
    """Process one sample. True if it changes the boot time: by a correction or a reboot (`rebooted`)."""
    booted = now - time_boot_ms / 1000
    clock_ms = boot.clock_ms
    is_next = boot.doubt_ms is None and clock_ms is not None and 0 < time_boot_ms - clock_ms < HALF
    if is_next and 0 <= booted - boot.at < STEP_BACK:
        boot.clock_ms = time_boot_ms  # nearly every sample
        return False
    if clock_ms is None or clock_ms < time_boot_ms < clock_ms + HALF or time_boot_ms < clock_ms - HALF:  # it wraps
        # transport only delays samples, so the earliest boot time is the most accurate
        boot.clock_ms = time_boot_ms
        refutes = boot.doubt_ms is not None and clock_ms is not None and _refutes(boot, clock_ms, now)
        boot.doubt_ms = None
        if clock_ms is not None and 0 <= booted - boot.at < STEP_BACK and not refutes:
            return False
        boot.ahead = clock_ms is not None and boot.at - booted > APART
        boot.at, boot.rebooted, boot.in_turn = min(booted, boot.at) if refutes else booted, False, refutes
        return True
    if (clock_ms - time_boot_ms) % WRAP <= STEP_BACK_MS:
        boot.doubt_ms = None
        return False
    if boot.doubt_ms is None or (time_boot_ms - boot.doubt_ms + HALF) % WRAP < HALF:
        boot.doubt_ms = time_boot_ms
        return False
    if _is_repeated(boot, clock_ms, booted):
        boot.doubt_ms = None
        return False
    boot.in_turn = boot.shown is not None and abs(booted - boot.shown) < STEP_BACK_MS / 1000
    boot.at, boot.clock_ms, boot.doubt_ms, boot.shown = booted, time_boot_ms, None, booted
    boot.rebooted, boot.ahead = True, False
    return True


def _is_repeated(boot: BootClock, clock_ms: int, booted: float) -> bool:
    """Whether a step back to a clock that started at `booted` shows old packets: its boot lies within the present run.

    The last sample was sent at `clock_ms` after the boot of this run, whenever it arrived.
    """
    run = clock_ms / 1000
    return booted - boot.at < min(run - min(STEP_BACK, DRIFT * run), APART)


def _refutes(boot: BootClock, clock_ms: int, now: float) -> bool:
    """Note that a step back was not confirmed. True if that repeats: two clocks alternate sample by sample."""
    assert boot.doubt_ms is not None
    if (clock_ms - boot.doubt_ms) % WRAP <= APART * 1000:
        return False
    boot.refuted = boot.refuted + 1 if now - boot.refuted_at <= APART else 1
    boot.refuted_at = now
    return boot.refuted >= REFUTED
