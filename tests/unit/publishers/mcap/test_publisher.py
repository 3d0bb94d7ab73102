from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import McapRecord, Message
from mcap.stream_reader import StreamReader

from mav_robot_status.clock import Instant
from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.extras import install
from mav_robot_status.gateway.replay import NoMavlinkPort
from mav_robot_status.interface import PublisherContext
from mav_robot_status.publishers.json_lines import native, native_body
from mav_robot_status.publishers.mcap.publisher import FLUSH, RETRY, McapPublisher
from mav_robot_status.publishers.mcap.settings import Limits, limits_of
from mav_robot_status.publishers.ros.definitions import DEFINITIONS
from mav_robot_status.publishers.ros.messages import DIAGNOSTIC_ARRAY, ROBOT_STATUS, robot_status

from ..port import msg


def made(path: Path, patient: bool = False, **options: object) -> McapPublisher:
    given = {"path": str(path), **options}
    return McapPublisher(PublisherContext(given, NoMavlinkPort(), io.StringIO(), patient))


def read(path: Path) -> list[tuple[Any, Any, Any]]:
    with path.open("rb") as file:
        return list(make_reader(file).iter_messages())


def test_a_channel_of_each_handle_has_the_json_lines_with_our_schema(tmp_path: Path) -> None:
    publisher = made(tmp_path / "a.mcap")
    for handle in ("rover", "copter", "rover"):
        publisher.publish(msg(handle=handle))
    publisher.close()
    publisher.close()
    found = read(tmp_path / "a.mcap")
    assert [channel.topic for _, channel, _ in found] == [
        "/rover/robot_status",
        "/copter/robot_status",
        "/rover/robot_status",
    ]
    one = msg(handle="rover")
    assert found[2][2].data.decode() == native(one, 1, native_body("rover", one.status, one.detail))
    assert {message.log_time for _, _, message in found} == {one.unix_us * 1000}
    schema, channel, _ = found[0]
    assert (schema.name, schema.encoding, channel.message_encoding) == (
        "mav_robot_status.RobotStatus",
        "jsonschema",
        "json",
    )
    assert json.loads(schema.data)["type"] == "object"


def test_the_channels_of_ros2_have_the_bytes_of_the_ros2_output(tmp_path: Path) -> None:
    publisher = made(tmp_path / "a.mcap", format="ros2")
    publisher.publish(msg(handle="rover"))
    publisher.close()
    found = {channel.topic: (schema, channel, message) for schema, channel, message in read(tmp_path / "a.mcap")}
    assert set(found) == {"/rover/robot_status", "/diagnostics"}
    schema, channel, message = found["/rover/robot_status"]
    assert (schema.name, schema.encoding, channel.message_encoding) == (ROBOT_STATUS.ros_name, "ros2msg", "cdr")
    assert message.data == robot_status(msg(handle="rover"))


@pytest.mark.parametrize("kind", [ROBOT_STATUS, DIAGNOSTIC_ARRAY], ids=lambda kind: kind.name)
def test_a_definition_has_the_type_hash_that_ros2_gives_it(kind: Any) -> None:
    types = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed: pip install rosbags")
    store = types.get_typestore(types.Stores.EMPTY)
    name, *parts = DEFINITIONS[kind.ros_name].split("=" * 80 + "\nMSG: ")
    store.register(types.get_types_from_msg(name, kind.ros_name))
    for part in parts:
        package, _, rest = part.partition("/")
        title, _, text = rest.partition("\n")
        store.register(types.get_types_from_msg(text, f"{package}/msg/{title}"))
    assert store.hash_rihs01(kind.ros_name) == kind.hash


def test_a_file_of_a_killed_gateway_has_everything_but_its_last_second(tmp_path: Path) -> None:
    publisher = made(tmp_path / "a.mcap")
    publisher.publish(msg())
    assert publisher.service(Instant(10.0, 0)) == 10.0 + FLUSH
    assert publisher.queued == 1
    assert publisher.service(Instant(10.0 + FLUSH, 0)) is None
    assert publisher.queued == 0
    publisher.publish(msg())
    (tmp_path / "killed.mcap").write_bytes((tmp_path / "a.mcap").read_bytes())
    publisher.close()
    with (tmp_path / "killed.mcap").open("rb") as file:
        records = StreamReader(file).records
        assert sum(isinstance(record, Message) for record in until_the_end(records)) == 1


def until_the_end(records: Iterator[McapRecord]) -> Iterator[McapRecord]:
    """The records before the end of a file without index."""
    with contextlib.suppress(EndOfFile):
        yield from records


def test_an_existing_file_is_kept_and_a_split_file_has_the_next_free_name(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"mine")
    publisher = made(tmp_path / "a.mcap", split="1s")
    for second in (0, 1, 1):
        publisher.publish(msg()._replace(unix_us=second * 1_000_000))
    publisher.close()
    assert (tmp_path / "a.mcap").read_bytes() == b"mine"
    assert [len(read(tmp_path / name)) for name in ("a-2.mcap", "a-3.mcap")] == [1, 2]


def test_a_file_that_fails_is_followed_by_a_new_one_and_what_is_lost_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publisher = made(tmp_path / "a.mcap")
    publisher.publish(msg())
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        publisher.service(Instant(0.0, 0))
        publisher.service(Instant(FLUSH, 0))
        assert publisher.dropped == 1
        publisher.publish(msg())
        assert publisher.dropped == 2
        assert publisher.service(Instant(2.0, 0)) == 2.0 + RETRY
        publisher.service(Instant(2.0 + RETRY, 0))
        assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
        publisher.service(Instant(3.0 + RETRY, 0))
    assert publisher.service(Instant(3.0 + 2 * RETRY, 0)) is None
    publisher.publish(msg())
    publisher.close()
    assert len(read(tmp_path / "a-2.mcap")) == 1


def full(descriptor: int, data: bytes) -> int:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_replay_ends_when_its_file_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    publisher = made(tmp_path / "a.mcap", patient=True)
    publisher.publish(msg())
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        with pytest.raises(LinkError, match=r"cannot write MCAP to .*a.mcap: No space left on device"):
            publisher.close()


def test_a_file_that_cannot_be_created_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"cannot write MCAP to .*: No such file or directory"):
        made(tmp_path / "none" / "a.mcap")


@pytest.mark.parametrize(
    ("text", "limits"), [(None, Limits()), ("1h", Limits(us=3.6e9)), ("1.5 MB", Limits(size=1.5e6))]
)
def test_a_split_is_a_time_or_a_size(text: str | None, limits: Limits) -> None:
    assert limits_of(text) == limits


@pytest.mark.parametrize("text", ["", "1", "h", "0h", "1 parsec", "-1h", "1e9h"])
def test_another_split_is_one_line(text: str) -> None:
    with pytest.raises(UsageError, match=r"mcap: split: .* is no time or size; write 1h or 100MB"):
        limits_of(text)


def test_a_missing_extra_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "mav_robot_status.publishers.mcap.file", raising=False)
    monkeypatch.delattr("mav_robot_status.publishers.mcap.file", raising=False)
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(UsageError) as raised:
        made(tmp_path / "a.mcap")
    assert str(raised.value) == f"mcap: this output needs an extra: {install('mcap')}"
    assert not list(tmp_path.iterdir())
