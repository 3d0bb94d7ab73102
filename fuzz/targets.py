"""The fuzz targets. Each reads bytes, raises on a defect, and returns the number of units (frames, files) it tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from mav_robot_status.clock import Instant
from mav_robot_status.config.document import parse_document
from mav_robot_status.config.reader import build
from mav_robot_status.errors import ConfigError, UsageError
from mav_robot_status.gateway.logs.onboard_recording import DATAFLASH, DATAFLASH_TEXT, ULOG, form_of
from mav_robot_status.hardware.mavlink.faults import text_assembly
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.px4_events import ARMING_SUMMARY, HEALTH_SUMMARY
from mav_robot_status.hardware.mavlink.px4_events.ids import CAUSE_AT
from mav_robot_status.hardware.mavlink.px4_events.parsing import TableError
from mav_robot_status.hardware.mavlink.px4_events.parsing import parse as parse_table
from mav_robot_status.hardware.mavlink.px4_events.sequence import ASKABLE, KEPT
from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
from mav_robot_status.hardware.onboard_log.interface import OnboardLogRobotHW
from mav_robot_status.interface import validate
from mav_robot_status.links.url import parse
from mav_robot_status.mavlink.definitions import MESSAGES, CurrentEventSequence, Event, Heartbeat, Statustext
from mav_robot_status.mavlink.encode import enclose, encode
from mav_robot_status.mavlink.framing import CHECK, FIRST_CREDIT, Frame, Parser
from mav_robot_status.mavlink.ftp.metadata import MOST_TABLE
from mav_robot_status.mavlink.ftp.payload import ACK, NAK, OPCODES, PAYLOAD, Payload, unpack
from mav_robot_status.mavlink.ftp.table_download import TableDownload
from mav_robot_status.mavlink.signing import Signer, Verifier, is_signed
from mav_robot_status.mavlink.wire import MAX_FRAME
from mav_robot_status.publishers.simple_message.requests import RequestReader
from mav_robot_status.simple_message import ORDERS
from mav_robot_status.simple_message import SHORTEST as SHORTEST_REQUEST

from .mutate import MOST_BYTES
from .routing import World
from .work import checks, cut

SHORTEST_FRAME: Final = 8
PIECE: Final = 97
"""Bytes of one feed, so that feeds end anywhere within a frame."""
KEY: Final = bytes(32)
SOME: Final = sorted(WANTED_IDS)
MOST_REQUESTS: Final = 200
"""The most requests of a download after the last answer: it gives up long before."""
MOST_PENDING: Final = 1 << 17
"""Bytes of an incomplete record: a message of ULog has at most 65538."""
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
        hw.on_frame(frame, now)
        if mono >= hw.next_due():
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


def event_table(data: bytes) -> int:
    """Any file of PX4's events: it is a table whose texts are lines, or the error is one line."""
    try:
        table = parse_table(data)
    except TableError as error:
        _one_line(error)
        return 1
    for number in table.events:
        event = Event(number, 0, 0, 0, 0, 0, data[:40])
        for text in (table.message(event), table.description(event)):
            assert text is None or text.isprintable(), text
    return 1


def events(data: bytes) -> int:
    """Any events of a PX4 in any order: nothing grows, and none of them takes the motion of an armed vehicle."""
    hw = MavlinkRobotHW(HardwareOptions())
    parser = Parser(WANTED_IDS)
    count = 0
    for chunk in _chunks(bytes(80) + data):
        count += 1
        now = Instant(100 + count / 4, count * 250_000)
        beat = Heartbeat(4 << 16, 2, 12, 209, 4, 3)
        for number, message in enumerate((beat, _event(chunk, count))):
            (frame,) = parser.feed(encode(message, system=1, component=1, sequence=2 * count + number & 255))
            hw.on_frame(frame, now)
        hw.read(now)
        hw.due_requests(now)
    (tracked,) = hw.vehicles
    assert tracked.state is not None
    assert len(tracked.state.events.events) <= KEPT
    assert len(tracked.state.events.missing) <= ASKABLE
    assert tracked.handle.status.drives_powered == 1
    return count


def _event(chunk: bytes, count: int) -> Event | CurrentEventSequence:
    """An event of a report, or a count, with a sequence number that is mostly near the last one."""
    sequence = (count + chunk[0] % 8 - 4 if chunk[0] < 250 else chunk[1] << 8 | chunk[0]) & 0xFFFF
    if chunk[1] % 8 == 0:
        return CurrentEventSequence(sequence, chunk[2] // 250)
    number = (ARMING_SUMMARY, HEALTH_SUMMARY, HEALTH_SUMMARY, *CAUSE_AT)[chunk[1] % 6]
    return Event(number, count * 250, sequence, 0, 0, chunk[2], chunk[3:].ljust(40, b"\0")[:40])


def onboard_log(data: bytes) -> int:
    """Any onboard log: its reader keeps little, time does not go back but at a new start, the status is consistent.

    A unit is an input.
    """
    form = form_of(data) or (DATAFLASH, DATAFLASH_TEXT, ULOG)[len(data) % 3]
    hw = OnboardLogRobotHW(lambda: form.meaning(HardwareOptions()), "log", HardwareOptions())
    reader = form.reader(hw.meaning.wanted())
    pieces = [data[start : start + PIECE] for start in range(0, len(data), PIECE)]
    us, mono = 0, 0.0
    for found in (*map(reader.feed, pieces), reader.finish()):
        for record in found:
            if record.us < us:
                hw.forget()
            mono, us = mono + min(max(record.us - us, 0), 10**9) / 1e6, record.us
            hw.begun(0.0, reader.names())
            hw.on_frame(record, Instant(mono, us))
            if mono >= hw.next_due():
                hw.read(Instant(mono, us))
            form.utc_us(record.values)
        assert reader.pending <= MOST_PENDING
    assert reader.counts.bad_bytes <= len(data)
    for handle in hw.handles:
        hw.read(Instant(mono + 0.5, us))
        problem = validate(handle.status, handle.detail, stops_cut_power=False)
        assert problem is None, problem
    return 1


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


def simple_message(data: bytes) -> int:
    """Any bytes of a client, in pieces of any size: less than a header is held, and pieces make no difference.

    A unit is a byte.
    """
    for order in ORDERS:
        replies = RequestReader(order).feed(data)
        for size in (1, 7, PIECE):
            reader = RequestReader(order)
            found = []
            for start in range(0, len(data), size):
                found.append(reader.feed(data[start : start + size]))
                assert reader.pending < SHORTEST_REQUEST
            assert b"".join(found) == replies
        assert len(replies) <= len(data)
    return max(len(data), 1)


def _one_line(error: Exception) -> None:
    text = str(error)
    assert text, "the error has no message"
    assert "\n" not in text, text
    assert len(text) < LONGEST_LINE, len(text)


def files(data: bytes) -> int:
    """Any answers of a file server at any time: every request is one that only reads, and the download ends."""
    download = TableDownload("mftp://etc/general", 0, 1, rate=(1000.0, 20_000.0)[len(data) % 2], now=0.0)
    mono, count = 0.0, 0
    asked = download.due(0.0)
    for chunk in _chunks(data):
        count += 1
        mono += chunk[0] / 64
        asked = download.due(mono) or asked
        assert asked is not None
        assert asked.opcode in OPCODES
        download.heard(_answer(asked, chunk), mono)
        arrived, size = download.progress
        assert 0 <= arrived <= size <= MOST_TABLE
    for _ in range(MOST_REQUESTS):
        mono = max(mono, min(download.next_due(), mono + 3600))
        download.due(mono)
    assert download.ended
    assert download.outcome is not None
    return max(count, 1)


def _answer(asked: Payload, chunk: bytes) -> Payload:
    """An answer to a request: mostly one that fits."""
    kind, ahead = chunk[1] % 8, chunk[2] % 4
    answer = asked._replace(sequence=asked.sequence + 1 + ahead & 0xFFFF, opcode=ACK, req_opcode=asked.opcode)
    if kind == 0:
        answer = answer._replace(opcode=NAK)
    elif kind == 1:
        answer = answer._replace(offset=int.from_bytes(chunk[3:7], "little"), burst_complete=chunk[2] & 1)
    elif kind == 2:
        answer = unpack(chunk.ljust(PAYLOAD, b"\0")) or answer
    return answer._replace(data=chunk[3:], size=len(chunk) - 3)


TARGETS: Final[dict[str, Callable[[bytes], int]]] = {
    "framing": framing,
    "work": work,
    "messages": messages,
    "signing": signing,
    "texts": texts,
    "event_table": event_table,
    "events": events,
    "files": files,
    "configuration": configuration,
    "connection": connection,
    "routing": routing,
    "simple_message": simple_message,
    "onboard_log": onboard_log,
}
UNITS: Final = {
    "work": "bytes",
    "simple_message": "bytes",
    "configuration": "configurations",
    "connection": "connection strings",
    "texts": "chunks",
    "event_table": "tables",
    "events": "events",
    "files": "answers",
    "onboard_log": "logs",
}

assert set(SOME) <= set(MESSAGES)
