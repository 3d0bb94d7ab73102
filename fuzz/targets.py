"""The fuzz targets. Each reads bytes, raises on a defect, and returns the number of units (frames, files) it tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from mav_robot_status.clock import Instant
from mav_robot_status.config.document import parse_document
from mav_robot_status.config.reader import build
from mav_robot_status.errors import ConfigError, UsageError
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.message_table import WANTED_IDS
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import text_assembly
from mav_robot_status.links.url import parse
from mav_robot_status.mavlink.definitions import MESSAGES, Statustext
from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.mavlink.framing import CHECK, FIRST_CREDIT, Frame, Parser
from mav_robot_status.mavlink.signing import Signer, Verifier, is_signed
from mav_robot_status.mavlink.wire import MAX_FRAME

from .mutate import MOST_BYTES
from .routing import World
from .work import checks, cut

SHORTEST_FRAME: Final = 8
PIECE: Final = 97
"""Bytes of one feed, so that feeds end anywhere within a frame."""
KEY: Final = bytes(32)
SOME: Final = sorted(WANTED_IDS)
LONGEST_LINE: Final = 2000
"""The most characters of an error message."""


def framing(data: bytes) -> int:
    """Any bytes: the parser does not raise, keeps at most MAX_FRAME bytes, and counts no byte twice.

    A unit is a frame, valid or not.
    """
    for wanted in (WANTED_IDS, None):
        parser = Parser(wanted)
        returned = 0
        for start in range(0, len(data), PIECE):
            for frame in parser.feed(data[start : start + PIECE]):
                returned += len(frame.raw)
            assert parser.pending <= MAX_FRAME
        assert returned + parser.pending + parser.counters.garbage_bytes <= len(data)
    counters = parser.counters
    return (
        counters.frames + counters.incompatible + sum(counters.bad_crc.values()) + sum(counters.unknown.values()) or 1
    )


def work(data: bytes) -> int:
    """Any bytes in pieces of any size: the parser computes few CRCs for each byte. A unit is a byte."""
    for piece in (1, PIECE, MOST_BYTES):
        number, total = checks(cut(data, piece))
        assert number <= 3 * (len(data) + FIRST_CREDIT) / CHECK + len(data) / SHORTEST_FRAME + 1, number
        assert total <= MAX_FRAME * number
    return max(len(data), 1)


def messages(data: bytes) -> int:
    """Valid frames of three vehicles with any payload at any time: the status keeps its invariants."""
    hw = MavlinkRobotHW(HardwareOptions())
    parser = Parser(WANTED_IDS)
    mono, count = 0.0, 0
    for chunk in _chunks(data):
        count += 1
        mono += chunk[0] / 16
        system = chunk[1] % 3
        message_id = 0 if count <= 3 else SOME[chunk[2] % len(SOME)]
        now = Instant(mono, int(mono * 1e6))
        (frame,) = parser.feed(enclose(message_id, chunk[3:], system=system, component=1, sequence=count & 255))
        hw.take(frame, now)
        if hw.dirty_vehicles or mono >= hw.next_due():
            hw.read(now)
            hw.due_requests(now)
    for tracked in hw.vehicles:
        status = tracked.handle.status
        assert not (status.motion_possible == 1 and (status.e_stopped == 1 or status.drives_powered != 1)), status
        assert (status.error_code != 0) == (status.in_error == 1), status
    return max(count, 1)


def _chunks(data: bytes) -> Iterator[bytes]:
    """Cut data into pieces: three bytes of header with the length, then a payload."""
    at = 0
    while at + 4 <= len(data):
        size = 4 + data[at] % 60
        yield data[at + 1 : at + 1 + size].ljust(3, b"\0")
        at += 1 + size


def signing(data: bytes) -> int:
    """Frames with any signature block, none signed with our key: the verifier accepts none."""
    verifier = Verifier(Signer(KEY, 1), "none")
    count = 0
    for frame in Parser(None).feed(data):
        count += 1
        accepted = verifier.accepts(frame, 1_800_000_000_000_000)
        assert not accepted or is_signed(frame)
    raw = b"\xfd" + data[:279]
    verifier.accepts(Frame(0, (1, 1), 0, None, raw), 0)
    return count + 1


def texts(data: bytes) -> int:
    """Text chunks with any id, number and bytes: the assembly keeps a bounded number."""
    assembly = text_assembly.EMPTY
    count = 0
    for chunk in _chunks(data):
        count += 1
        now = Instant(count / 4, 0)
        message = Statustext(chunk[0] % 9, chunk[3:].ljust(50, b"\0")[:50], chunk[1] % 5, chunk[2] % 40)
        assembly, _ = text_assembly.heard_chunk(assembly, message, now)
        assembly, _ = text_assembly.overdue(assembly, now.mono)
        assert len(assembly) <= text_assembly.MOST_TEXTS
    return max(count, 1)


def configuration(data: bytes) -> int:
    """Any configuration file: it is valid, or the error is one line."""
    try:
        build(parse_document(data.decode("utf-8", "replace"), "fuzz.yaml"))
    except ConfigError as error:
        _one_line(error)
    return 1


def connection(data: bytes) -> int:
    """Any connection string: it is valid, or the error is one line."""
    try:
        parse(data.decode("utf-8", "replace"))
    except UsageError as error:
        _one_line(error)
    return 1


def routing(data: bytes) -> int:
    """A minute of a companion computer whose links come and go: no heartbeat is late, no loop amplifies."""
    world = World(data)
    world.run(60.0)
    return world.made


def _one_line(error: Exception) -> None:
    text = str(error)
    assert text, "the error has no message"
    assert "\n" not in text, text
    assert len(text) < LONGEST_LINE, len(text)


TARGETS: Final[dict[str, Callable[[bytes], int]]] = {
    "framing": framing,
    "work": work,
    "messages": messages,
    "signing": signing,
    "texts": texts,
    "configuration": configuration,
    "connection": connection,
    "routing": routing,
}
UNITS: Final = {
    "work": "bytes",
    "configuration": "configurations",
    "connection": "connection strings",
    "texts": "chunks",
}

assert set(SOME) <= set(MESSAGES)
