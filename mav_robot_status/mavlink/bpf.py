"""A program for the kernel that drops datagrams without a wanted message: classic BPF, for a UDP socket.

It drops a datagram only if that is one whole frame of an id that is not wanted, unsigned and without another flag. It
passes everything else: several frames in one datagram, a part of a frame, other bytes. It does not check the CRC.

The format: https://www.kernel.org/doc/Documentation/networking/filter.txt. On a UDP socket offset 0 is the UDP header.
A load beyond the end of the datagram would drop it, so the length is compared first. Jumps go forward, and those with a
condition by at most 255 instructions.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final

from ..values import NamedTuple
from .wire import FORMATS, V1, V2

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

UDP_HEADER: Final = 8
CRC: Final = 2
MOST_INSTRUCTIONS: Final = 4096
"""The limit of the kernel."""
LONGEST_JUMP: Final = 255
AT_ONCE: Final = 4
"""Up to this many ids are compared one after another; a longer list is halved first."""

LOAD_BYTE, LOAD_WORD, LOAD_LENGTH, TO_X = 0x30, 0x20, 0x80, 0x07
ADD, AND, JUMP, IF_EQUAL, IF_EQUAL_X, IF_AT_LEAST, RETURN = 0x04, 0x54, 0x05, 0x15, 0x1D, 0x35, 0x06


class Instruction(NamedTuple):
    """struct sock_filter."""

    code: int
    operand: int = 0
    yes: int = 0
    """How many instructions a condition that is true skips."""
    no: int = 0


PASS: Final = Instruction(RETURN, 0xFFFFFFFF)
DROP: Final = Instruction(RETURN, 0)


def program(wanted: Collection[int]) -> list[Instruction]:
    """The program that passes frames of these message ids. Raises ValueError if there are too many for the kernel."""
    version_2 = _version_2(wanted)
    made = [
        *_pass_if_shorter(FORMATS[V1].header),
        Instruction(LOAD_BYTE, UDP_HEADER),
        Instruction(IF_EQUAL, V1, no=1),
        Instruction(JUMP, 2 + len(version_2)),
        Instruction(IF_EQUAL, V2, yes=1),
        PASS,
        *version_2,
        *_version_1(wanted),
    ]
    if len(made) > MOST_INSTRUCTIONS:
        raise ValueError(f"{len(wanted)} ids make {len(made)} instructions; the kernel takes {MOST_INSTRUCTIONS}")
    return made


def packed(instructions: Collection[Instruction]) -> bytes:
    """The instructions as an array of struct sock_filter."""
    return b"".join([struct.pack("=HBBI", one.code, one.yes, one.no, one.operand) for one in instructions])


def _version_2(wanted: Collection[int]) -> list[Instruction]:
    """For a datagram that starts as a frame of MAVLink 2: the id is in the bytes 7 to 9, the lowest first."""
    header = FORMATS[V2].header
    return [
        *_pass_if_shorter(header),
        Instruction(LOAD_BYTE, UDP_HEADER + 2),  # the incompatibility flags
        Instruction(IF_EQUAL, 0, yes=1),
        PASS,
        *_pass_unless_one_frame(header),
        Instruction(LOAD_WORD, UDP_HEADER + 6),  # the component and the id, in the order of the network
        Instruction(AND, 0xFFFFFF),
        *_search(sorted(int.from_bytes(number.to_bytes(3, "little"), "big") for number in wanted)),
    ]


def _version_1(wanted: Collection[int]) -> list[Instruction]:
    """The same for MAVLink 1: the id is byte 5."""
    return [
        *_pass_unless_one_frame(FORMATS[V1].header),
        Instruction(LOAD_BYTE, UDP_HEADER + 5),
        *_search(sorted(number for number in wanted if number < 256)),
    ]


def _pass_if_shorter(header: int) -> list[Instruction]:
    """Pass a datagram that is shorter than the shortest frame."""
    return [Instruction(LOAD_LENGTH), Instruction(IF_AT_LEAST, UDP_HEADER + header + CRC, yes=1), PASS]


def _pass_unless_one_frame(header: int) -> list[Instruction]:
    """Pass a datagram that does not end with the frame. Byte 1 is the length of the payload."""
    return [
        Instruction(LOAD_BYTE, UDP_HEADER + 1),
        Instruction(ADD, UDP_HEADER + header + CRC),
        Instruction(TO_X),
        Instruction(LOAD_LENGTH),
        Instruction(IF_EQUAL_X, yes=1),
        PASS,
    ]


def _search(ids: Sequence[int]) -> list[Instruction]:
    """Pass if the loaded number is one of these, in ascending order; else drop."""
    count = len(ids)
    if count <= AT_ONCE:
        return [*(Instruction(IF_EQUAL, number, yes=count - i) for i, number in enumerate(ids)), DROP, PASS]
    lower, upper = _search(ids[: count // 2]), _search(ids[count // 2 :])
    middle = ids[count // 2]
    if len(lower) <= LONGEST_JUMP:
        return [Instruction(IF_AT_LEAST, middle, yes=len(lower)), *lower, *upper]
    return [Instruction(IF_AT_LEAST, middle, no=1), Instruction(JUMP, len(lower)), *lower, *upper]
