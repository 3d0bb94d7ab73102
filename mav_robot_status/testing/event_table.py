"""A small table of events in the format of PX4, and the files with which the fake PX4 serves it.

It has the ids and arguments of PX4's arming report and failsafes, and texts of its own.
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Mapping
from typing import NamedTuple

from ..json_object import JsonMapping, JsonObject
from ..mavlink.ftp.metadata import EVENTS, crc32
from .firmware import px4_mode

GENERAL = "etc/extras/component_general.json.xz"
PATH = "etc/extras/all_events.json.xz"


class VehicleFiles(NamedTuple):
    """What a vehicle says about its metadata, and its files by their path."""

    uri: str
    crc: int
    files: Mapping[str, bytes]


def event_id(name: str) -> int:
    """The low 24 bits of the id of an event: FNV-1a of its name. PX4's autopilot adds 1 << 24, its component id."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x01000193 & 0xFFFFFFFF
    return number & 0xFFFFFF


def _events(*events: JsonObject) -> JsonObject:
    return {"events": {str(event_id(event["name"])): event for event in events}}


def _arguments(*types: str) -> list[dict[str, str]]:
    return [{"name": f"argument{number}", "type": kind} for number, kind in enumerate(types)]


def _check(name: str, message: str, description: str) -> JsonObject:
    arguments = _arguments("navigation_mode_group_t", "uint8_t")
    return {"name": name, "message": message, "description": description, "arguments": arguments}


def _enum(kind: str, *names: str, bits: bool = False) -> JsonObject:
    entries = {str(1 << n if bits else n): {"name": name, "description": name} for n, name in enumerate(names)}
    return {"type": kind, "is_bitfield": bits, "entries": entries}


_MASK = "navigation_mode_group_t"
TABLE: JsonObject = {
    "version": 1,
    "components": {
        "1": {
            "namespace": "px4",
            "enums": {
                _MASK: _enum("uint32_t", "manual", "altctl", "posctl", "mission", "loiter", "rtl", bits=True),
                "health_component_t": _enum("uint64_t", "none", "absolute_pressure", "gps", bits=True),
                "failsafe_action_t": _enum("uint8_t", "none", "warn"),
                "failsafe_cause_t": _enum("uint8_t", "generic", "manual_control_loss", "gcs_connection_loss"),
            },
            "event_groups": {
                "arming_check": _events(
                    {
                        "name": "commander_arming_check_summary",
                        "type": "summary",
                        "message": "Arming check summary",
                        "arguments": _arguments("uint8_t", "health_component_t", "health_component_t", _MASK, _MASK),
                    },
                    _check("check_modes_manual_control", "The remote control is missing", "Switch it on."),
                    _check("check_modes_global_pos", "The position is not known", "Wait for a GPS fix."),
                ),
                "health": _events(
                    {
                        "name": "commander_health_summary",
                        "type": "summary",
                        "message": "Health summary",
                        "arguments": _arguments("uint8_t", *("health_component_t",) * 3),
                    }
                ),
                "default": _events(
                    {
                        "name": "commander_failsafe_enter",
                        "message": "{3}: {2}",
                        "arguments": _arguments("uint32_t", "failsafe_action_t", "failsafe_cause_t"),
                    }
                ),
            },
            "navigation_mode_groups": {
                "groups": {
                    "0": [px4_mode(1)],
                    "1": [px4_mode(2)],
                    "2": [px4_mode(3)],
                    "3": [px4_mode(4, 4)],
                    "4": [px4_mode(4, 3)],
                    "5": [px4_mode(4, 5)],
                }
            },
            "supported_protocols": ["health_and_arming_check"],
        }
    },
}


def event_files(
    table: JsonMapping | bytes = TABLE, address: str = f"mftp://{PATH}", uri: str = f"mftp://{GENERAL}"
) -> VehicleFiles:
    """The files of a vehicle with this table, or with any bytes as its file.

    The general file gives `address` as the place of the table. COMPONENT_METADATA gives `uri` as the place of the
    general file.
    """
    data = table if isinstance(table, bytes) else lzma.compress(json.dumps(table).encode())
    entry = {"type": EVENTS, "uri": address, "fileCrc": crc32(data), "uriFallback": ""}
    general = lzma.compress(json.dumps({"version": 1, "metadataTypes": [entry]}).encode())
    return VehicleFiles(uri, crc32(general), {GENERAL: general, PATH: data})
