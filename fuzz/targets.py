"""What is fuzzed: each target takes bytes, raises on a defect, and says how many units (frames, files) it has tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from mav_robot_status.clock import Instant
from mav_robot_status.config.document import parse_document
from mav_robot_status.config.reader import build
from mav_robot_status.errors import ConfigError, UsageError
from mav_robot_status.hardware import statustext
from mav_robot_status.hardware.kinds import WANTED_IDS
from mav_robot_status.hardware.options import HardwareOptions
from mav_robot_status.hardware.robot_hw import MavlinkRobotHW
from mav_robot_status.link.url import parse
from mav_robot_status.mavlink.definitions import MESSAGES, Statustext
from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.mavlink.framing import Frame, Parser
from mav_robot_status.mavlink.signing import Signer, Verifier, is_signed
from mav_robot_status.mavlink.wire import MAX_FRAME

PIECE: Final = 97
"""Bytes fed at once: frames are cut everywhere."""
KEY: Final = bytes(32)
SOME: Final = sorted(WANTED_IDS)
LONGEST_LINE: Final = 2000
"""Characters of a message for a person, at most."""


def framing(data: bytes) -> int:
    """Bytes as they come: nothing raises, little is kept, no byte is counted twice. A unit is a frame, good or bad."""
    for wanted in (WANTED_IDS, None):
        parser = Parser(wanted)
        taken = 0
        for start in range(0, len(data), PIECE):
            for frame in parser.feed(data[start : start + PIECE]):
                taken += len(frame.raw)
            assert parser.pending <= MAX_FRAME
        assert taken + parser.pending + parser.counters.garbage_bytes <= len(data)
    counters = parser.counters
    return (
        counters.frames + counters.incompatible + sum(counters.bad_crc.values()) + sum(counters.unknown.values()) or 1
    )


def messages(data: bytes) -> int:
    """Frames with a good CRC and any payload, at any time, of three vehicles: hardware and status hold."""
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
        if hw.stirred or mono >= hw.next_due():
            hw.read(now)
            hw.write(now)
    for tracked in hw.vehicles:
        status = tracked.handle.status
        assert not (status.motion_possible == 1 and (status.e_stopped == 1 or status.drives_powered != 1)), status
        assert (status.error_code != 0) == (status.in_error == 1), status
    return max(count, 1)


def _chunks(data: bytes) -> Iterator[bytes]:
    """Pieces of a length that the data itself tells: three bytes of header, a payload."""
    at = 0
    while at + 4 <= len(data):
        size = 4 + data[at] % 60
        yield data[at + 1 : at + 1 + size].ljust(3, b"\0")
        at += 1 + size


def signing(data: bytes) -> int:
    """Frames that nobody signed with our key, with a signature block of any content: none is accepted."""
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
    """Chunks of texts with any id, number and bytes: few are kept."""
    assembly = statustext.EMPTY
    count = 0
    for chunk in _chunks(data):
        count += 1
        now = Instant(count / 4, 0)
        message = Statustext(chunk[0] % 9, chunk[3:].ljust(50, b"\0")[:50], chunk[1] % 5, chunk[2] % 40)
        assembly, _ = statustext.heard_chunk(assembly, message, now)
        assembly, _ = statustext.overdue(assembly, now.mono)
        assert len(assembly) <= statustext.MOST_TEXTS
    return max(count, 1)


def configuration(data: bytes) -> int:
    """A configuration file of any content: understood, or one line that says what is wrong."""
    try:
        build(parse_document(data.decode("utf-8", "replace"), "fuzz.yaml"))
    except ConfigError as error:
        _one_line(error)
    return 1


def connection(data: bytes) -> int:
    """A connection string of any content: understood, or one line that says what to write."""
    try:
        parse(data.decode("utf-8", "replace"))
    except UsageError as error:
        _one_line(error)
    return 1


def _one_line(error: Exception) -> None:
    text = str(error)
    assert text, "nothing is said"
    assert "\n" not in text, text
    assert len(text) < LONGEST_LINE, len(text)


TARGETS: Final[dict[str, Callable[[bytes], int]]] = {
    "framing": framing,
    "messages": messages,
    "signing": signing,
    "texts": texts,
    "configuration": configuration,
    "connection": connection,
}
UNITS: Final = {"configuration": "configurations", "connection": "connection strings", "texts": "chunks"}

assert set(SOME) <= set(MESSAGES)
