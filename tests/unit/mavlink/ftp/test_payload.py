from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.ftp.payload import ACK, MOST_DATA, NAK, PAYLOAD, READ_FILE, Payload, message, unpack

BYTE = st.integers(0, 255)


@given(st.integers(0, 0xFFFF), BYTE, BYTE, st.binary(max_size=MOST_DATA), st.integers(0, 0xFFFFFFFF), BYTE, BYTE)
def test_what_is_packed_is_unpacked(
    sequence: int, session: int, opcode: int, data: bytes, offset: int, req_opcode: int, complete: int
) -> None:
    payload = Payload(sequence, session, opcode, data, offset, len(data), req_opcode, complete)
    assert len(payload.pack()) == PAYLOAD
    assert unpack(payload.pack()) == payload


@given(st.binary(min_size=PAYLOAD, max_size=PAYLOAD))
def test_any_field_is_a_payload_or_has_an_impossible_size(field: bytes) -> None:
    found = unpack(field)
    assert (found is None) == (field[4] > MOST_DATA)
    assert found is None or len(found.data) == found.size


def test_a_request_is_short_on_the_wire() -> None:
    request = Payload(1, 0, READ_FILE, b"", 1000, MOST_DATA)
    assert len(encode(message(request, 1, 1), system=1, component=192, sequence=0)) < 30


def test_an_error_has_a_name() -> None:
    assert Payload(1, 0, NAK, b"\x0a", size=1).error == "FileNotFound"
    assert Payload(1, 0, NAK, b"\x02\x0d", size=2).error == "FailErrno (errno 13)"
    assert Payload(1, 0, NAK, b"\xc8", size=1).error == "error 200"
    assert Payload(1, 0, ACK).code == 0
