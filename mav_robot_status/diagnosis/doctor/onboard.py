"""`doctor` on an autopilot's own log: what it holds, what it lacks, and what to set to have it next time."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final, NamedTuple

from ...gateway.replay import ReplayPipeline, run_through
from ...interface.explanation import explanation
from ...streams import NO_OUTPUT
from ..explain import silent

if TYPE_CHECKING:
    from ...config import Config
    from ...gateway.logs.onboard_recording import OnboardRecording
    from ...json_object import JsonObject


class Needed(NamedTuple):
    """Records of which one must be in a log."""

    names: tuple[str, ...]
    without: str
    """What is not known without them."""
    step: str
    """How the next log has them."""


LACKS: Final[dict[str, tuple[Needed, ...]]] = {
    "ARDUPILOTMEGA": (
        Needed(("ARM", "EV"), "it does not tell when it was armed", "set LOG_BITMASK to 65535 or more"),
        Needed(("MODE",), "the flight mode is unknown", "set LOG_BITMASK to 65535 or more"),
        Needed(("MSG",), "there are no texts, so reasons against arming are missing", "set LOG_DISARMED to 1"),
        Needed(("RCOU",), "a motor test of a disarmed robot is not seen", "add RCOUT to LOG_BITMASK"),
        Needed(("GPS", "XKF1", "NKF1"), "the speed is unknown", "add GPS to LOG_BITMASK"),
        Needed(("PARM",), "the motor outputs are unknown: the parameters are missing", "set LOG_DISARMED to 1"),
    ),
    "PX4": (
        Needed(("actuator_armed",), "the kill switch and the termination are unknown", "log the default topics"),
        Needed(("vehicle_status",), "mode, failsafes and reasons are unknown", "log the default topics"),
        Needed(("vehicle_local_position",), "the speed is unknown", "log the default topics"),
        Needed(("vehicle_land_detected",), "whether it is landed is unknown", "log the default topics"),
        Needed(("message",), "there are no texts", "log the default topics"),
    ),
}
"""By autopilot, the most important first."""


class OnboardFindings(NamedTuple):
    """What a log holds."""

    path: str
    words: str
    """Its form."""
    clock: str
    seconds: float
    records: int
    bad_bytes: int
    dropouts: int
    gaps: int
    late_start: float | None
    """Seconds from the start of the autopilot to the first record, if the log misses the beginning."""
    lacks: tuple[Needed, ...]
    trouble: str | None
    status: JsonObject


FROM_BOOT: Final = 30.0
"""Seconds after which the start of the autopilot is not in the log."""


def examine(config: Config, recording: OnboardRecording) -> OnboardFindings:
    """Read a log to its end. Raises UsageError."""
    pipeline = ReplayPipeline(silent(config), NO_OUTPUT, recording=recording)
    end = run_through(pipeline, recording)
    hw = recording.robot
    pipeline.hw.read(end)
    counts, began = recording.counts, recording.first_us / 1e6
    needed = LACKS[hw.meaning.name]
    return OnboardFindings(
        recording.path,
        recording.form.words,
        recording.preview.clock,
        round(recording.seconds, 1),
        counts.records,
        counts.bad_bytes,
        counts.dropouts,
        hw.gaps,
        round(began, 1) if began > FROM_BOOT else None,
        tuple(one for one in needed if hw.seen.isdisjoint(one.names)),
        recording.trouble,
        explanation(next(iter(hw.handles)), end),
    )


def cause(f: OnboardFindings) -> str:
    """The word for the finding."""
    return "log-lacks" if f.lacks else "ok"


def remarks(f: OnboardFindings) -> list[str]:
    """What the log holds and lacks, a line each."""
    vehicle = f.status["vehicle"]
    names = (vehicle["autopilot"], vehicle.get("firmware"), vehicle["type"])
    told = [
        f"{', '.join(str(name) for name in names if name)}: {f.records} records in {f.seconds:.1f} s",
        f"the stamps are UTC {f.clock}",
        *(f"no {' or '.join(one.names)}: {one.without}" for one in f.lacks),
    ]
    if f.late_start is not None:
        told.append(f"it begins {f.late_start:.0f} s after the start of the autopilot: what was said before is unknown")
    faults = (
        (f.gaps, "gaps of more than 1 s, in which nothing is known"),
        (f.dropouts, "dropouts noted by the autopilot"),
        (f.bad_bytes, "bytes that belong to no record"),
    )
    told += [f"{number} {what}" for number, what in faults if number]
    return told + ([f.trouble] if f.trouble else [])


def step(f: OnboardFindings) -> str:
    """The next action."""
    return f.lacks[0].step if f.lacks else f"see what stopped it: mav-robot-status report {f.path}"


def as_text(f: OnboardFindings) -> list[str]:
    """The finding, the remarks and the next action, as lines."""
    matter = f"a status is available{', but the log lacks records' if f.lacks else ''}"
    lines = [f"{f.words} {f.path}: {matter} [{cause(f)}]", *(f"  {line}" for line in remarks(f))]
    return [*lines, f"next: {step(f)}"]


def as_json(f: OnboardFindings) -> str:
    """The same as a JSON object. Members and causes are stable; the wording is not."""
    return json.dumps(
        {
            "connection": f.path,
            "cause": cause(f),
            "ok": True,
            "found": remarks(f),
            "next": step(f),
            "seconds": f.seconds,
            "records": f.records,
            "bad_bytes": f.bad_bytes,
            "dropouts": f.dropouts,
            "gaps": f.gaps,
            "lacks": ["/".join(one.names) for one in f.lacks],
        }
    )
