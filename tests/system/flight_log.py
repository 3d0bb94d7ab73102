"""A recorded log that a test writes, and the lines that the installed command makes of it.

The streams of one vehicle are attributes; `run` lets time pass. Times in the log are exact, so no test waits.
"""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from struct import pack
from typing import Any, Final

from tests import pymavlink_dialect as mav

from .gateway_process import run

ARDUPILOT, PX4 = 3, 12
PLANE, QUAD, ROVER, SUB = 1, 2, 10, 12
STANDBY, ACTIVE = 3, 4
MOTORS, PREARM = 1 << 15, 1 << 28
FITTED: Final = 0x2F | MOTORS | 1 << 21 | 1 << 25
START_US: Final = 1_800_000_000_000_000
STEP_US: Final = 250_000
VEHICLE, STATION = (1, 1), (255, 190)


class FlightLog:
    """The log of one vehicle."""

    def __init__(self, path: Path, vehicle_type: int, autopilot: int = ARDUPILOT) -> None:
        self._path, self.type, self.autopilot = path, vehicle_type, autopilot
        self.armed, self.state = False, STANDBY
        self.health, self.enabled = FITTED | PREARM, FITTED | PREARM
        self.sys_status_period = 1.0
        """Seconds."""
        self.outputs: tuple[int, ...] | None = None
        """us; None: no SERVO_OUTPUT_RAW. So with the others."""
        self.throttle: int | None = None
        self.speed, self.climb = 0.0, 0.0
        self.rpm: int | None = None
        self.rc: tuple[int, ...] | None = None
        self.vtol_state: int | None = None
        self.applet: float | None = None
        self._us = 0
        self._log = bytearray()
        self._senders: dict[tuple[int, int], Any] = {}

    @property
    def now(self) -> float:
        """Seconds since the start of the log."""
        return self._us / 1e6

    def add(self, message: Any, sender: tuple[int, int] = VEHICLE) -> FlightLog:
        """One message now."""
        source = self._senders.setdefault(sender, mav.MAVLink(None, srcSystem=sender[0], srcComponent=sender[1]))
        self._log += pack(">Q", START_US + self._us) + message.pack(source)
        return self

    def text(self, text: str) -> FlightLog:
        """A STATUSTEXT."""
        return self.add(mav.MAVLink_statustext_message(6, text.encode()))

    def version(self, major: int, minor: int, patch: int) -> FlightLog:
        """AUTOPILOT_VERSION of a release."""
        number = major << 24 | minor << 16 | patch << 8 | 255
        return self.add(mav.MAVLink_autopilot_version_message(0, number, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0))

    def option(self, channel: int, value: int) -> FlightLog:
        """RCn_OPTION."""
        return self.add(mav.MAVLink_param_value_message(f"RC{channel}_OPTION".encode(), value, 4, 1, 0))

    def stop_command(self, position: int) -> FlightLog:
        """A ground station's MAV_CMD_DO_AUX_FUNCTION of the emergency stop."""
        return self.add(mav.MAVLink_command_long_message(*VEHICLE, 218, 0, 31, position, 0, 0, 0, 0, 0), STATION)

    def ack(self) -> FlightLog:
        """The vehicle accepts the auxiliary function."""
        return self.add(mav.MAVLink_command_ack_message(218, 0, 0, 0, *STATION))

    def set(self, **changes: Any) -> FlightLog:
        """Change what the streams say."""
        for name, value in changes.items():
            assert hasattr(self, name), name
            setattr(self, name, value)
        return self

    def run(self, seconds: float, **changes: Any) -> FlightLog:
        """Apply the changes and let time pass."""
        self.set(**changes)
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self._streams()
            self._us += STEP_US
        return self

    def silence(self, seconds: float) -> FlightLog:
        """Nothing is received."""
        self._us += round(seconds * 1e6)
        return self

    def _streams(self) -> None:
        if self._us % 1_000_000 == 0:
            base_mode = 0x51 | (0x80 if self.armed else 0)
            self.add(mav.MAVLink_heartbeat_message(self.type, self.autopilot, base_mode, 0, self.state, 3))
            if self.applet is not None:
                self.add(mav.MAVLink_named_value_float_message(self._us // 1000, b"RS_STOP", self.applet))
        if self._us % round(self.sys_status_period * 1e6) == 0:
            masks = FITTED | PREARM, self.enabled, self.health
            self.add(mav.MAVLink_sys_status_message(*masks, 0, 12000, 0, 90, 0, 0, 0, 0, 0, 0))
        if self._us % 500_000:
            return
        if self.vtol_state is not None:
            self.add(mav.MAVLink_extended_sys_state_message(self.vtol_state, 2))
        if self.throttle is not None:
            self.add(mav.MAVLink_vfr_hud_message(self.speed, self.speed, 0, self.throttle, 100.0, self.climb))
        if self.rpm is not None:
            four = [self.rpm] * 4
            self.add(mav.MAVLink_esc_telemetry_1_to_4_message(*[[0] * 4] * 4, four, [0] * 4))
        if self.rc is not None:
            pulses = (*self.rc, *[0] * 18)[:18]
            self.add(mav.MAVLink_rc_channels_message(0, 18, *pulses, 255))
        if self.outputs is not None:
            pulses = (*self.outputs, *[0] * 16)[:16]
            self.add(mav.MAVLink_servo_output_raw_message(self._us, 0, *pulses))

    def replayed(self, *arguments: str) -> Replayed:
        """What the installed command makes of it."""
        self._path.write_bytes(self._log)
        done = run(str(self._path), *arguments)
        assert done.returncode == 0, done.stderr
        return Replayed([json.loads(line) for line in done.stdout.splitlines()], done.stderr)


class Replayed:
    """The lines of a replay."""

    def __init__(self, lines: list[dict[str, Any]], log: str) -> None:
        self.log = log
        self._lines = [(_seconds(line), line) for line in lines]

    def line(self, at: float) -> dict[str, Any]:
        """The last line not later than `at` (seconds since the start)."""
        return [line for when, line in self._lines if when <= at][-1]

    def stop(self, at: float) -> tuple[Any, Any, Any]:
        """e_stopped, drives_powered, motion_possible."""
        line = self.line(at)
        return line["e_stopped"], line["drives_powered"], line["motion_possible"]

    def stops(self, start: float, end: float) -> set[tuple[Any, Any, Any]]:
        """All of them between two times."""
        return {self.stop(start)} | {self.stop(when) for when, _ in self._lines if start <= when <= end}


def _seconds(line: dict[str, Any]) -> float:
    stamp = datetime.fromisoformat(line["stamp"].replace("Z", "+00:00")).timestamp()
    return round(stamp - START_US / 1e6, 6)
