"""Reports of PX4's arming checks as events, and a small table of events of our own."""

from __future__ import annotations

import json
from collections.abc import Iterable
from struct import pack
from typing import Any, Final

from mav_robot_status.hardware.mavlink.px4_events import ARMING_SUMMARY, HEALTH_SUMMARY, EventTable
from mav_robot_status.hardware.mavlink.px4_events.ids import ALL_MODES, event_id
from mav_robot_status.hardware.mavlink.px4_events.parsing import parse
from mav_robot_status.mavlink.definitions import Event

MANUAL, LOITER, MISSION = 1 << 16, 4 << 16 | 3 << 24, 4 << 16 | 4 << 24
"""Values of custom_mode."""
MANUAL_GROUP, MISSION_GROUP, LOITER_GROUP = 1 << 0, 1 << 3, 1 << 4
GPS, REMOTE_CONTROL = 3, 7
"""Indices of health components."""
NO_FIX, NO_STICKS, BARE = event_id("test_no_fix"), event_id("test_no_sticks"), event_id("test_bare")
RC_LOSS = event_id("commander_failsafe_enter")

Failing = tuple[int, int, int, int]
"""A failing check: its event, the mask of mode groups, the health component, and its log level."""
WAIT: Final = 'Wait. <profile name="dev">See <param>EKF2_GPS_CHECK</param></profile>'
NO_FIX_NOW: Final = (NO_FIX, LOITER_GROUP | MISSION_GROUP, GPS, 3)
NO_STICKS_NOW: Final = (NO_STICKS, ALL_MODES, REMOTE_CONTROL, 4)
BLOCKED: Final = ALL_MODES & ~(LOITER_GROUP | MISSION_GROUP)


def event(number: int, sequence: int, time_ms: int, arguments: bytes = b"", level: int = 6) -> Event:
    """One event, with its level both inside and outside."""
    return Event(number, time_ms, sequence & 0xFFFF, 0, 0, level << 4 | level, arguments.ljust(40, b"\0"))


def report(
    first: int,
    can_arm: int = BLOCKED,
    failing: Iterable[Failing] = (NO_FIX_NOW,),
    time_ms: int = 60_000,
    chunk: int = 0,
) -> list[Event]:
    """The events of one report; `first` is the sequence number of the first."""
    failing = list(failing)
    bits = 0
    for _, _, component, _ in failing:
        bits |= 1 << component
    events = [event(ARMING_SUMMARY, first, time_ms, pack("<BIIII", chunk, bits, 0, can_arm, ALL_MODES), 8)]
    for number, modes, component, level in failing:
        arguments = pack("<IBB", modes, component, 2)
        events.append(event(number, first + len(events), time_ms, arguments, level))
    events.append(event(HEALTH_SUMMARY, first + len(events), time_ms, pack("<BIII", chunk, bits, 0, 0), 8))
    return events


def document() -> dict[str, Any]:
    """A table of two checks and a failsafe."""
    check = [{"name": "modes", "type": "group_t"}, {"name": "component", "type": "uint8_t"}]
    return {
        "version": 2,
        "components": {
            "1": {
                "namespace": "px4",
                "enums": {
                    "group_t": {"type": "uint32_t", "is_bitfield": True, "entries": {}},
                    "navigation_mode_group_t": {
                        "type": "uint32_t",
                        "is_bitfield": True,
                        "entries": {
                            "1": {"name": "manual", "description": "Manual"},
                            "8": {"name": "mission", "description": "Mission"},
                            "16": {"name": "loiter", "description": ""},
                        },
                    },
                    "health_component_t": {
                        "type": "uint32_t",
                        "is_bitfield": True,
                        "entries": {"8": {"name": "gps", "description": "GPS"}},
                    },
                    "cause_t": {"type": "uint8_t", "entries": {"1": {"name": "rc", "description": "Sticks lost"}}},
                },
                "navigation_mode_groups": {"groups": {"0": [MANUAL], "3": [MISSION], "4": [LOITER], "23": [184811520]}},
                "event_groups": {
                    "arming_check": {
                        "events": {
                            str(NO_FIX & 0xFFFFFF): {
                                "name": "test_no_fix",
                                "message": "GPS {3} has no fix",
                                "description": WAIT,
                                "arguments": [*check, {"name": "instance", "type": "uint8_t"}],
                            },
                            str(NO_STICKS & 0xFFFFFF): {
                                "name": "test_no_sticks",
                                "message": "No sticks",
                                "arguments": check,
                            },
                        }
                    },
                    "default": {
                        "events": {
                            str(RC_LOSS & 0xFFFFFF): {
                                "name": "commander_failsafe_enter",
                                "message": "{3}: action {2}",
                                "arguments": [{"type": "uint32_t"}, {"type": "uint8_t"}, {"type": "px4::cause_t"}],
                            },
                            str(BARE & 0xFFFFFF): {"name": "test_bare", "message": "Alarm"},
                        }
                    },
                },
            }
        },
    }


def table() -> EventTable:
    """The table of `document`."""
    return parse(json.dumps(document()).encode())
