"""The fake autopilot's frames: through pymavlink, and ours for what pymavlink does not define."""

from __future__ import annotations

import random
from typing import Any

import pytest

from mav_robot_status.mavlink.definitions import MESSAGES, Definition, Heartbeat
from mav_robot_status.testing.codec import decode, encode
from tests.pymavlink_dialect import MAVLink, MAVLink_statustext_message

UNLIKE = {"current", "failure_flags", "rpm", "voltage", "temperature"}
"""Arrays of numbers in messages that pymavlink does not define: the bytes of the wire."""


def example(definition: Definition) -> Any:
    """A message whose bytes all differ; texts are letters."""
    raw = bytes(random.Random(definition.id).sample(range(97, 123), 26)) * 20
    return definition.type(*definition.layout.unpack(raw[: definition.layout.size]))


@pytest.mark.parametrize("definition", MESSAGES.values(), ids=lambda d: d.name)
def test_a_frame_is_read_with_the_values_and_the_sender_that_it_has(definition: Definition) -> None:
    data = encode(example(definition), system=3, component=4, sequence=5)
    (theirs,) = MAVLink(None).parse_buffer(data)
    (ours,) = decode(data)
    assert (ours.get_type(), ours.get_msgId()) == (definition.name, definition.id)
    assert (ours.get_srcSystem(), ours.get_srcComponent(), ours.get_seq()) == (3, 4, 5)
    for name in set(ours.get_fieldnames()).difference(UNLIKE):
        value = getattr(ours, name)
        assert (list(value) if isinstance(value, bytes) else value) == getattr(theirs, name), name


def test_the_fake_autopilot_reads_the_frames_of_pymavlink_trimmed_or_signed() -> None:
    mav = MAVLink(None, srcSystem=9, srcComponent=8)
    mav.signing.secret_key = bytes(32)
    mav.signing.sign_outgoing = True
    (message,) = decode(MAVLink_statustext_message(2, b"Crash: Disarming").pack(mav))
    assert (message.get_msgId(), message.severity, message.text, message.id) == (253, 2, "Crash: Disarming", 0)


def test_what_is_no_message_is_skipped() -> None:
    data = encode(Heartbeat(0, 2, 3, 81, 4, 3), system=1, component=1, sequence=0)
    assert [message.autopilot for message in decode(b"no frame" + data[:-1] + bytes((data[-1] ^ 1,)) + data)] == [3]
