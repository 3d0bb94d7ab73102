"""The fake autopilot's frames. Compares with pymavlink in both directions."""

from __future__ import annotations

import random
import subprocess
import sys

import pytest

from mav_robot_status.mavlink.definitions import Definition
from mav_robot_status.testing.codec import decode, encode
from mav_robot_status.testing.definitions import MESSAGES, TEXTS, Heartbeat, Statustext
from tests.pymavlink_dialect import MAVLink, MAVLink_statustext_message


def example(definition: Definition) -> tuple[int | float | bytes, ...]:
    """Values of all fields: each byte of the payload is different, texts are letters."""
    chance = random.Random(definition.id)
    values = definition.type(*definition.layout.unpack(chance.randbytes(definition.layout.size)))._asdict()
    for name, value in values.items():
        if isinstance(value, float):
            values[name] = 0.5
        elif name in TEXTS:
            values[name] = b"abc".ljust(len(value), b"d")
    return tuple(values.values())


@pytest.mark.parametrize("definition", MESSAGES.values(), ids=lambda d: d.name)
def test_pymavlink_reads_every_field_of_the_fake_autopilot(definition: Definition) -> None:
    message = definition.type(*example(definition))
    (theirs,) = MAVLink(None).parse_buffer(encode(message, system=3, component=4, sequence=5))
    (ours,) = decode(encode(message, system=3, component=4, sequence=5))
    assert (theirs.get_type(), theirs.get_srcSystem(), theirs.get_srcComponent(), theirs.get_seq()) == (
        (definition.name, 3, 4, 5)
    )
    assert (ours.get_type(), ours.get_srcSystem(), ours.get_srcComponent(), ours.get_seq()) == (
        definition.name,
        3,
        4,
        5,
    )
    expected = theirs.to_dict()
    for name, value in ours.to_dict().items():
        if not isinstance(value, bytes):
            assert value == expected[name], name
    assert ours.to_dict().keys() == expected.keys()


def test_the_fake_autopilot_reads_the_frames_of_pymavlink_trimmed_or_signed() -> None:
    mav = MAVLink(None, srcSystem=9, srcComponent=8)
    mav.signing.secret_key = bytes(32)
    mav.signing.sign_outgoing = True
    (message,) = decode(MAVLink_statustext_message(2, b"Crash: Disarming").pack(mav))
    assert (message.get_msgId(), message.severity, message.text, message.id) == (253, 2, "Crash: Disarming", 0)


def test_a_field_that_a_message_does_not_have_is_an_attribute_error() -> None:
    (message,) = decode(encode(Heartbeat(0, 2, 3, 81, 4, 3), system=1, component=1, sequence=0))
    assert message.autopilot == 3
    with pytest.raises(AttributeError, match="HEARTBEAT has no field 'text'"):
        _ = message.text


def test_a_class_that_is_not_a_message_cannot_be_encoded() -> None:
    with pytest.raises(KeyError):
        encode(Statustext(0, b"", 0, 0)._replace()._asdict(), system=1, component=1, sequence=0)  # type: ignore[arg-type]


def test_the_fake_autopilot_runs_without_pymavlink() -> None:
    program = "import sys, mav_robot_status.demo; sys.exit('pymavlink' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], timeout=60).returncode == 0
