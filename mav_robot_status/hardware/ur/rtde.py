"""RTDE, the Real-Time Data Exchange of Universal Robots: one connection as a pure protocol machine.

A frame is u16 size, u8 type, payload; all numbers are big-endian. The client asks for protocol version 2, names the
values that it wants (a recipe), and starts. Then the controller sends these values at the rate of the recipe.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide".
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from struct import Struct
from typing import Any, Final, NamedTuple

from ...errors import ProtocolError

HEADER: Final = Struct(">HB")
PROTOCOL: Final = 2
VERSION, CONTROLLER, OUTPUTS, START, DATA = b"VvOSU"
"""The types of the frames that are read: protocol version, version of the controller, recipe, start, values."""
LONGEST: Final = 4096
"""A longer frame is garbage: a text has at most 516 bytes, our values have 64. Two letters are always longer."""

TYPES: Final = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
NOT_FOUND: Final = "NOT_FOUND"
FIRMWARE: Final = Struct(">IIII")
RATE: Final = Struct(">d")


class Recipe(NamedTuple):
    """What each data frame contains."""

    number: int
    """Its first byte."""
    layout: Struct
    names: tuple[str, ...]
    sizes: tuple[int, ...]
    """How many numbers each value has."""


class Step(Enum):
    """What the client waits for."""

    VERSION = "the protocol version"
    CONTROLLER = "the version of the controller"
    OUTPUTS = "the types of the values"
    START = "the start"
    DATA = "values"


class Session:
    """One connection. `sent` has what to send next; the caller empties it.

    It asks one question at a time: a controller may drop what follows a question in the same segment.
    """

    def __init__(self, names: Sequence[str], rate: float, *, with_firmware: bool = True) -> None:
        """Ask for the values of these names at `rate` Hz, and before for the version of the controller."""
        self.missing: tuple[str, ...] = ()
        """Names that the controller does not know."""
        self.firmware: str | None = None
        """The version of the controller: `5.11.1`."""
        self.step = Step.VERSION
        self.sent = frame(VERSION, PROTOCOL.to_bytes(2, "big"))
        self._with_firmware = with_firmware
        self._names = tuple(names)
        self._rate = rate
        self._recipe: Recipe | None = None
        self._rest = b""

    def feed(self, data: bytes) -> list[dict[str, Any]]:
        """Process received bytes. Returns the values of each data frame, by name. Raises ProtocolError."""
        buffer = self._rest + data
        found: list[dict[str, Any]] = []
        at = 0
        while len(buffer) - at >= HEADER.size:
            size, kind = HEADER.unpack_from(buffer, at)
            if not HEADER.size <= size <= LONGEST:
                raise ProtocolError(f"this is not RTDE; it begins with {buffer[at : at + 12].hex(' ')}")
            if len(buffer) - at < size:
                break
            values = self._frame(kind, buffer[at + HEADER.size : at + size])
            if values is not None:
                found.append(values)
            at += size
        self._rest = buffer[at:]  # less than one frame
        return found

    def go_on(self) -> None:
        """Ask for the values, also if the version of the controller did not arrive."""
        if self.step is Step.CONTROLLER:
            self._ask()

    def _frame(self, kind: int, payload: bytes) -> dict[str, Any] | None:
        if kind == DATA:
            return self._values(payload)
        if kind == CONTROLLER and len(payload) >= FIRMWARE.size:
            self.firmware = "{}.{}.{}".format(*FIRMWARE.unpack_from(payload)[:3])
            self.go_on()
        elif kind == VERSION and self.step is Step.VERSION:
            if payload[:1] != b"\1":
                raise ProtocolError(f"the controller does not speak RTDE version {PROTOCOL}: it is too old")
            self.step = Step.CONTROLLER
            if self._with_firmware:
                self.sent += frame(CONTROLLER)
            else:
                self.go_on()
        elif kind == OUTPUTS and self.step is Step.OUTPUTS:
            self._answered(payload)
        elif kind == START and self.step is Step.START:
            if payload[:1] != b"\1":
                raise ProtocolError("the controller refuses to start")
            self.step = Step.DATA
        return None  # texts and what is not for us

    def _ask(self) -> None:
        self.step = Step.OUTPUTS
        self.sent += frame(OUTPUTS, RATE.pack(self._rate) + ",".join(self._names).encode("ascii"))

    def _answered(self, payload: bytes) -> None:
        """The recipe: u8 number, types. Ask again without the names that the controller does not know."""
        types = payload[1:].decode("ascii", "replace").split(",")
        if len(types) != len(self._names):
            raise ProtocolError(f"{len(types)} types for {len(self._names)} values")
        known = [name for name, kind in zip(self._names, types, strict=True) if kind in TYPES]
        if not known:
            raise ProtocolError("the controller knows none of the values, or another client has them")
        if len(known) < len(types):
            self.missing += tuple(name for name in self._names if name not in known)
            self._names = tuple(known)
            self._ask()
            return
        layout = Struct(">" + "".join(TYPES[kind] for kind in types))
        sizes = tuple(int(TYPES[kind][:-1] or 1) for kind in types)
        self._recipe = Recipe(payload[0], layout, self._names, sizes)
        self.step = Step.START
        self.sent += frame(START)

    def _values(self, payload: bytes) -> dict[str, Any] | None:
        recipe = self._recipe
        if recipe is None or payload[:1] != bytes([recipe.number]):
            return None
        if len(payload) != 1 + recipe.layout.size:
            raise ProtocolError(f"{len(payload)} bytes of values instead of {1 + recipe.layout.size}")
        numbers = recipe.layout.unpack_from(payload, 1)
        values: dict[str, Any] = {}
        at = 0
        for name, size in zip(recipe.names, recipe.sizes, strict=True):
            values[name] = numbers[at] if size == 1 else numbers[at : at + size]
            at += size
        return values


def frame(kind: int, payload: bytes = b"") -> bytes:
    """One frame."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload
