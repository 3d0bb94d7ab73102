"""Flights of random messages that reach every handler. The same seed gives the same flight."""

from __future__ import annotations

import random
from collections.abc import Callable
from struct import pack
from typing import Any, Final

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.px4_events import ARMING_SUMMARY, HEALTH_SUMMARY
from mav_robot_status.mavlink import definitions as mav

from .driver import (
    ACTIVE,
    ARDUPILOT,
    CRITICAL,
    FENCE,
    FITTED,
    GPS,
    GYRO,
    MOTORS,
    PLANE,
    PREARM,
    PX4,
    QUAD,
    ROVER,
    STANDBY,
    TERMINATED,
    Flight,
    statustext,
)

STEPS: Final = (0.0, 0.0, 0.05, 0.2, 0.2, 0.5, 0.5, 1.0, 1.0, 2.5)
"""Seconds between two messages; rarely LONG_STEP."""
LONG_STEP: Final = 31.0
SPEEDS: Final = (0.0, 0.05, 0.2, 1.0, 3.0)
STOP_PWM, DRIVEN_PWM = 1000, 1632

KINDS: Final = ((ARDUPILOT, QUAD), (ARDUPILOT, ROVER), (ARDUPILOT, PLANE), (PX4, QUAD), (PX4, ROVER), (0, QUAD))

SETTINGS: Final[dict[str, tuple[Any, ...]]] = {
    "armed": (False, True),
    "state": (0, 1, STANDBY, ACTIVE, ACTIVE, CRITICAL, TERMINATED),
    "mode": (0, 5, 16, 4 << 16 | 3 << 24),
    "health": (FITTED, FITTED | PREARM, FITTED & ~GYRO | PREARM, FITTED | FENCE | PREARM),
    "enabled": (FITTED | PREARM, FITTED | FENCE | PREARM, FITTED & ~MOTORS | PREARM),
    "present": (FITTED | PREARM, FITTED | FENCE | PREARM, FITTED & ~GPS, 0),
    "internal_errors": (0, 0, 1),
}
"""The properties that the vehicle changes at random. The next messages carry them."""

TEXTS: Final = (
    "Radio Failsafe",
    "Radio Failsafe Cleared",
    "Battery 1 is low ",
    "Crash: Disarming",
    "Fence Breached",
    "PreArm: Motors Emergency Stopped",
    "PreArm: Compass not healthy",
    "PreArm: GPS 1: Bad fix",
    "Arm: Compass not healthy",
    "RC7: MotorEStop HIGH",
    "RC7: MotorEStop LOW",
    "Terminating due to GCS request",
    "Internal Errors 0x400",
    "PreArm: Internal errors 0x400 l:1 x",
    "Something bad",
    "Failsafe activated\t",
    "Preflight Fail: Attitude failure (roll)",
    "Emergency stop activated",
    "Kill engaged",
)
EVENTS: Final = (1, ARMING_SUMMARY, HEALTH_SUMMARY, HEALTH_SUMMARY)
PARAMETERS: Final = (b"SERVO1_FUNCTION", b"SERVO3_FUNCTION", b"SERVO5_FUNCTION", b"RC7_OPTION")
COMMANDS: Final = ((185, 1.0, 0.0), (218, 31.0, 2.0), (218, 31.0, 0.0))

Make = Callable[[Flight, random.Random], Any]


def _rpm(code: str, make: Callable[[bytes], Any]) -> Make:
    return lambda _, dice: make(pack(f"<4{code}", *[dice.choice((0, 0, 900))] * 4))


MESSAGES: Final[dict[type, Make]] = {
    mav.Heartbeat: lambda flight, _: flight.heartbeat(),
    mav.SysStatus: lambda flight, _: flight.sys_status(),
    mav.SystemTime: lambda flight, _: flight.system_time(),
    mav.Statustext: lambda _, dice: statustext(
        dice.choice(TEXTS), dice.randrange(8), dice.choice((0, 0, 0, 1)), dice.choice((0, 1))
    ),
    mav.Event: lambda flight, dice: mav.Event(
        dice.choice(EVENTS), flight.boot_ms, dice.randrange(99), 0, 0, dice.choice((0x42, 0x62, 0x88)), bytes(40)
    ),
    mav.CurrentEventSequence: lambda _, dice: mav.CurrentEventSequence(dice.randrange(99), dice.choice((0, 0, 1))),
    mav.ResponseEventError: lambda _, dice: mav.ResponseEventError(dice.randrange(99), dice.randrange(99), 0, 0, 0),
    mav.ExtendedSysState: lambda _, dice: mav.ExtendedSysState(dice.choice((0, 0, 3)), dice.randrange(5)),
    mav.GlobalPositionInt: lambda flight, dice: mav.GlobalPositionInt(
        flight.boot_ms, dice.choice((0, 1)), 0, round(100 * dice.choice(SPEEDS)), 0, 0
    ),
    mav.LocalPositionNed: lambda flight, dice: mav.LocalPositionNed(flight.boot_ms, dice.choice(SPEEDS), 0, 0),
    mav.VfrHud: lambda _, dice: mav.VfrHud(dice.choice(SPEEDS), dice.choice(SPEEDS), dice.choice((0, 50, 50))),
    mav.GpsRawInt: lambda _, dice: mav.GpsRawInt(round(100 * dice.choice(SPEEDS)), dice.choice((1, 3, 3))),
    mav.Attitude: lambda flight, dice: mav.Attitude(flight.boot_ms, 0, 0, dice.choice(SPEEDS)),
    mav.EkfStatusReport: lambda _, dice: mav.EkfStatusReport(dice.choice((0, 128))),
    mav.ServoOutputRaw: lambda _, dice: mav.ServoOutputRaw._make(
        (*[dice.choice((STOP_PWM, STOP_PWM, DRIVEN_PWM))] * 8, 0, *[0] * 8)
    ),
    mav.ParamValue: lambda _, dice: mav.ParamValue(
        dice.choice((0.0, 31.0, 33.0, 70.0, 165.0)), 0, 0, dice.choice(PARAMETERS), 2
    ),
    mav.EscTelemetry1To4: _rpm("H", lambda rpm: mav.EscTelemetry1To4(b"", b"", b"", rpm, b"", b"")),
    mav.EscTelemetry5To8: _rpm("H", lambda rpm: mav.EscTelemetry5To8(b"", b"", b"", rpm, b"", b"")),
    mav.EscTelemetry9To12: _rpm("H", lambda rpm: mav.EscTelemetry9To12(b"", b"", b"", rpm, b"", b"")),
    mav.EscStatus: _rpm("i", lambda rpm: mav.EscStatus(0, rpm, b"", b"", 0)),
    mav.BatteryStatus: lambda _, dice: mav.BatteryStatus(
        dice.choice((0, 0, 1)), dice.choice((0, 1, 3, 6)), dice.choice((0, 0, 16))
    ),
    mav.EscInfo: lambda _, dice: mav.EscInfo(
        pack("<4H", *[dice.choice((0, 0, 32)) for _ in range(4)]), dice.choice((0, 4)), 8, 15
    ),
    mav.OpenDroneIdArmStatus: lambda _, dice: mav.OpenDroneIdArmStatus(dice.choice((0, 1)), b"no fix"),
    mav.CommandLong: lambda _, dice: _command(*dice.choice(COMMANDS)),
    mav.CommandAck: lambda _, dice: mav.CommandAck(dice.choice((185, 218)), dice.choice((0, 0, 4)), 0, 0, 0, 0),
    mav.NamedValueFloat: lambda flight, dice: mav.NamedValueFloat(flight.boot_ms, dice.randrange(4), b"RS_STOP"),
    mav.RcChannels: lambda _, dice: mav.RcChannels(*[dice.choice((1000, 1900))] * 18),
    mav.MissionCurrent: lambda _, dice: mav.MissionCurrent(dice.randrange(3)),
    mav.CurrentMode: lambda flight, dice: mav.CurrentMode(flight.mode, flight.mode, dice.randrange(5)),
    mav.MessageInterval: lambda flight, dice: mav.MessageInterval(dice.randrange(-1, 10**6), dice.randrange(300)),
    mav.AvailableModes: lambda flight, dice: mav.AvailableModes(flight.mode, 0, 1, 1, dice.randrange(5), b"MODE"),
    mav.AutopilotVersion: lambda _, dice: mav.AutopilotVersion(dice.choice((0, 0x01090000, 0x04050600))),
}
"""A message of each type that has a handler, and a command of a ground station."""


def _command(command: int, param1: float, param2: float) -> mav.CommandLong:
    return mav.CommandLong(param1, param2, 0, 0, 0, 0, 0, command, 1, 1, 0)


def fly(seed: int, steps: int = 200) -> Flight:
    """A flight of random messages from a random vehicle: a few types at a time, like streams."""
    dice = random.Random(seed)
    options = HardwareOptions(watch_outputs=dice.random() < 0.9, estop_assume_visible=dice.random() < 0.5)
    flight = Flight(*dice.choice(KINDS), options=options, streams=False).hb()
    flight.wait(12)
    types = list(MESSAGES)
    active = types
    for _ in range(steps):
        if dice.random() < 0.1:
            name = dice.choice(list(SETTINGS))
            flight.set(**{name: dice.choice(SETTINGS[name])})
        if dice.random() < 0.02:
            flight.reboot(dice.choice((0.0, 100.0)))
        if dice.random() < 0.1:
            active = [mav.Heartbeat, mav.SysStatus, *dice.sample(types, dice.randint(1, 6))]
        make = dice.choice(active)
        sender = (255, 190) if make is mav.CommandLong else (1, 1)
        flight.wait(LONG_STEP if dice.random() < 0.005 else dice.choice(STEPS))
        flight.send(MESSAGES[make](flight, dice), sender)
    return flight
