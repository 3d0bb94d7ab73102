"""A log in memory: what its hardware interface says at each moment."""

from __future__ import annotations

from typing import NamedTuple

from mav_robot_status.clock import Instant
from mav_robot_status.gateway.logs.onboard_recording import form_of
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.onboard_log.interface import OnboardLogRobotHW
from mav_robot_status.interface import Detail, RobotStatus


class Said(NamedTuple):
    """What was said at a moment."""

    status: RobotStatus
    detail: Detail
    why: dict[str, str]

    @property
    def inhibits(self) -> set[str]:
        return {one.name for one in self.detail.inhibits}

    @property
    def errors(self) -> list[int]:
        return [one.code for one in self.detail.errors]


def at(data: bytes, *moments: float, options: HardwareOptions | None = None) -> list[Said]:
    """What the log says at these seconds since boot."""
    form = form_of(data)
    assert form is not None
    chosen = options or HardwareOptions()
    hw = OnboardLogRobotHW(lambda: form.meaning(chosen), "log", chosen)
    reader = form.reader(hw.meaning.wanted())
    records = [*reader.feed(data), *reader.finish()]
    found = []
    for moment in moments:
        while records and records[0].us <= moment * 1e6:
            record = records.pop(0)
            now = Instant(record.us / 1e6, record.us)
            if now.mono > hw.next_due():
                hw.read(Instant(hw.next_due(), record.us))
            hw.begun(0.0, reader.names())
            hw.on_frame(record, now)
        hw.read(Instant(moment, round(moment * 1e6)))
        (handle,) = hw.handles
        why = {name: f"{one.rule} [{one.source}]" for name, one in handle.evidence.items()}
        found.append(Said(handle.status, handle.detail, why))
    return found
