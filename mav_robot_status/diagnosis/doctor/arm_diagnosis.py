"""The diagnosis of an arm: findings, an ordered table of cases, and their text. Pure functions.

The first case that applies is the diagnosis, as in `diagnosis`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from ...interface import STATES, RobotStatus
from ...links.url import host_port
from ...simple_message import SHORTEST, STATE_PORT, STATUS, STATUS_LENGTH
from .advice import protocol
from .diagnosis import Case, Diagnosis, Test, first_case

DASHBOARD: Final = re.compile(rb"\AConnected: Universal Robots Dashboard Server")
PORTS: Final = {
    "ur": (30004, "start the controller, and enable RTDE in its settings, security, services"),
    "simple_message": (STATE_PORT, "start the driver of ROS-Industrial on the controller"),
}
"""The usual port of each type, and what to do if nothing serves it."""
STATUS_FRAMES: Final = {
    order: b"".join(number.to_bytes(4, order) for number in (STATUS_LENGTH, STATUS)) for order in ("little", "big")
}
"""How a status of simple_message begins, by its byte order."""


@dataclass(frozen=True)
class ArmFindings:
    """What was found about one hardware interface that is not MAVLink."""

    kind: str
    """Its registered type."""
    name: str
    """Its handle."""
    host: str = ""
    port: int = 0
    """Where its controller is. 0: not known, because another package knows it."""
    seconds: float = 0.0
    """How long it was listened to."""
    status: RobotStatus | None = None
    """What arrived within that time; None: nothing."""
    errors: tuple[str, ...] = ()
    inhibits: tuple[str, ...] = ()
    trouble: str = ""
    """Of the connection, a value of `Place.trouble`, or why the interface cannot be opened."""
    size: int = 0
    """Bytes that were received when it was asked again without the gateway."""
    head: bytes = b""
    """The first of them."""
    waits_for: str = ""
    """What did not arrive."""
    fault: str = ""
    """Why these bytes are of no use."""

    @property
    def where(self) -> str:
        """The address for a person."""
        return host_port(self.host, self.port)

    @property
    def connection(self) -> str:
        """As on the command line; the name of a hardware interface of another package."""
        return f"{self.kind}:{self.where}" if self.port else f"{self.kind} '{self.name}'"


def diagnose_arm(f: ArmFindings) -> Diagnosis:
    """The first case that applies."""
    return first_case(ARM_CASES, f, f.status is not None)


def _trouble(*values: str) -> Test:
    return lambda f: f.trouble in values


def _other_order(f: ArmFindings) -> str:
    return next((order for order, head in STATUS_FRAMES.items() if f.head.startswith(head)), "")


def _other_protocol(f: ArmFindings) -> str:
    known = protocol(f.head)
    return known.name if known else f"unknown: it begins with {f.head[:12].hex(' ')}"


def _other_port(f: ArmFindings) -> str:
    """The advice for a port on which there is something else, or nothing."""
    usual, start = PORTS[f.kind]
    right = f"{f.kind}:{host_port(f.host, usual)}"
    return start if f.port == usual else f"write the port of the controller, usually {right}; or {start}"


ARM_CASES: Final = (
    Case("ok", "a status is available",
         lambda f: f.status is not None,
         lambda f: "a status is available",
         lambda f: f"mav-robot-status --arm {f.connection}" if f.port else "mav-robot-status with this --config"),
    Case("unknown-name", "the name of the controller is unknown",
         _trouble("unknown name"),
         lambda f: f"the name {f.host} is unknown", lambda f: "check the name, or write the address"),
    Case("tcp-refused", "nothing listens on that TCP port of the controller",
         _trouble("refused"),
         lambda f: f"{f.where} refuses the connection: nothing listens on that TCP port",
         _other_port),
    Case("tcp-unreachable", "no answer from that address",
         _trouble("timeout", "unreachable"),
         lambda f: f"{f.where} cannot be reached: {f.trouble}",
         lambda f: f"check the address, the cable and the power of the controller: ping {f.host}"),
    Case("cannot-open", "the hardware interface cannot be opened",
         lambda f: f.trouble, lambda f: f.trouble, lambda f: "change its options in the configuration"),
    Case("dashboard-port", "this is the dashboard server of Universal Robots, not RTDE",
         lambda f: DASHBOARD.search(f.head),
         lambda f: f"{f.where} is the dashboard server, which has no state of the arm",
         lambda f: f"write --arm ur:{f.host}, which uses RTDE on port 30004"),
    Case("byte-order", "the controller has the other byte order",
         lambda f: f.kind == "simple_message" and f.fault and _other_order(f),
         lambda f: f"{f.where} sends statuses in the other byte order, {_other_order(f)} endian",
         lambda f: f"write byte_order: {_other_order(f)} for '{f.name}' in the section 'hardware' of a --config"),
    Case("other-type", "this is simple_message, not RTDE",
         lambda f: f.kind == "ur" and _other_order(f),
         lambda f: f"{f.where} serves simple_message, not RTDE",
         lambda f: f"write --arm simple_message:{f.where}"),
    Case("old-controller", "the controller does not have version 2 of RTDE",
         lambda f: "too old" in f.fault,
         lambda f: f"{f.where}: {f.fault}",
         lambda f: "update the software of the controller"),
    Case("other-protocol", "another service answers on this port",
         lambda f: f.fault and "it begins with" in f.fault,
         lambda f: f"{f.size} bytes arrived from {f.where}, of another protocol: {_other_protocol(f)}",
         _other_port),
    Case("not-understood", "the controller answers, but not as expected",
         lambda f: f.fault,
         lambda f: f"{f.where}: {f.fault}",
         lambda f: "end other clients of the controller; if the fault remains, restart the controller"),
    Case("incomplete", "bytes arrive, but less than a whole answer: half a frame, or too slow",
         lambda f: f.size,
         lambda f: f"{f.size} bytes arrived from {f.where}, then {f.waits_for} did not",
         lambda f: "check the network between: packet loss, MTU, a proxy; then restart the controller"),
    Case("tcp-silent", "the connection is open, and nothing arrives",
         lambda f: f.port,
         lambda f: f"{f.where} accepts the connection, but no byte arrives: {f.waits_for} did not arrive",
         _other_port),
    Case("no-status", "a hardware interface of another package reports no status",
         lambda f: True,
         lambda f: f"no status arrived within {f.seconds:.1f} s",
         lambda f: f"see the log above, and the documentation of '{f.kind}'"),
)  # fmt: skip
"""In the order of evaluation. The last one always applies."""


def arm_as_text(f: ArmFindings, diagnosis: Diagnosis) -> list[str]:
    """The diagnosis, the remarks and the next action, as lines."""
    return diagnosis.text(f.connection, _remarks(f))


def arm_as_json(f: ArmFindings, diagnosis: Diagnosis) -> str:
    """The same as a JSON object."""
    return json.dumps(
        {
            "connection": f.connection,
            "handle": f.name,
            **diagnosis.members(_remarks(f)),
            "seconds": f.seconds,
            "bytes": f.size,
            "status": None
            if f.status is None
            else {
                **{field.name: field.plain(getattr(f.status, field.name)) for field in STATES},
                "errors": f.errors,
                "inhibits": f.inhibits,
            },
        }
    )


def _remarks(f: ArmFindings) -> Iterator[str]:
    if f.status is not None:
        yield "status: " + ", ".join(f"{field.name} {field.word(getattr(f.status, field.name))}" for field in STATES)
    for what, names in (("errors", f.errors), ("inhibits", f.inhibits)):
        if names:
            yield f"{what}: {', '.join(names)}"
    if 0 < f.size < SHORTEST:
        yield f"received: {f.head.hex(' ')}"
