from __future__ import annotations

import contextlib
import io
import json
import os
import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    PublisherContext,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)
from mav_robot_status.publishers.json_lines import JsonLinesPublisher
from mav_robot_status.publishers.line_output import PIPE_BUF, RETRY_FAILED

from .port import Port

STAMP = 1_795_200_547_123_456
NOW = Instant(10.0, STAMP)
STATUS = RobotStatus(
    mode=RobotMode.AUTO,
    e_stopped=TriState.UNKNOWN,
    drives_powered=TriState.TRUE,
    motion_possible=TriState.FALSE,
    in_motion=TriState.TRUE,
    in_error=TriState.TRUE,
    error_code=2001,
)
DETAIL = Detail(
    1,
    1,
    (ErrorCause(2001, "RADIO_FAILSAFE", "Radio Failsafe", STAMP), ErrorCause(3005, "SENSOR_GPS", None, STAMP)),
    (Inhibit("E_STOPPED", None, STAMP),),
    Vehicle("ARDUPILOTMEGA", "GROUND_ROVER", "GUIDED", 15, "ACTIVE"),
)
MSG = RobotStatusMsg("robot", STAMP, STATUS, DETAIL, 0.4124)


class Pipe:
    """A standard output with a reader that reads on request."""

    def __init__(self) -> None:
        self.read_end, self.write_end = os.pipe()
        os.set_blocking(self.read_end, False)
        self.stdout = os.fdopen(self.write_end, "w", encoding="utf-8")

    def read(self) -> bytes:
        data = b""
        try:
            while piece := os.read(self.read_end, 1 << 16):
                data += piece
        except BlockingIOError:
            pass
        return data

    def leave(self) -> None:
        if self.read_end >= 0:
            os.close(self.read_end)
            self.read_end = -1


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    made = Pipe()
    yield made
    made.leave()
    made.stdout.close()


def on(pipe: Pipe, patient: bool = False, **options: Any) -> JsonLinesPublisher:
    return JsonLinesPublisher(PublisherContext(options, Port(), pipe.stdout, patient))


def test_a_native_line_has_the_documented_form(pipe: Pipe) -> None:
    on(pipe).publish(MSG)
    stamp = "2026-11-20T18:49:07.123456Z"
    assert json.loads(pipe.read()) == {
        "stamp": stamp,
        "seq": 0,
        "handle": "robot",
        "system": 1,
        "component": 1,
        "mode": "AUTO",
        "e_stopped": None,
        "drives_powered": True,
        "motion_possible": False,
        "in_motion": True,
        "in_error": True,
        "error_code": 2001,
        "errors": [
            {"code": 2001, "name": "RADIO_FAILSAFE", "text": "Radio Failsafe", "since": stamp},
            {"code": 3005, "name": "SENSOR_GPS", "text": None, "since": stamp},
        ],
        "inhibits": [{"name": "E_STOPPED", "text": None, "since": stamp}],
        "vehicle": {
            "autopilot": "ARDUPILOTMEGA",
            "type": "GROUND_ROVER",
            "flight_mode": "GUIDED",
            "custom_mode": 15,
            "state": "ACTIVE",
        },
        "link": {"state": "CONNECTED", "heartbeat_age": 0.412},
    }


def test_the_ros_1_form(pipe: Pipe) -> None:
    on(pipe, format="ros1").publish(MSG)
    assert json.loads(pipe.read()) == {
        "header": {"seq": 0, "stamp": {"secs": 1795200547, "nsecs": 123456000}, "frame_id": "robot"},
        "mode": {"val": 2},
        "e_stopped": {"val": -1},
        "drives_powered": {"val": 1},
        "motion_possible": {"val": 0},
        "in_motion": {"val": 1},
        "in_error": {"val": 1},
        "error_code": 2001,
    }


def test_the_ros_2_form_lists_every_code(pipe: Pipe) -> None:
    publisher = on(pipe, format="ros2")
    publisher.publish(MSG)
    publisher.publish(MSG._replace(detail=DETAIL._replace(errors=())))
    publisher.publish(MSG._replace(status=RobotStatus(), detail=Detail()))
    codes = [json.loads(line)["error_codes"] for line in pipe.read().splitlines()]
    assert codes == [[2001, 3005], [2001], []]


@pytest.mark.parametrize("form", ["ros1", "ros2"])
def test_the_ros_forms_of_a_group_have_its_handle_and_the_codes_of_all_members(pipe: Pipe, form: str) -> None:
    errors = tuple(error._replace(handle=name) for error, name in zip(DETAIL.errors, ("base", "arm"), strict=True))
    on(pipe, format=form).publish(MSG._replace(detail=DETAIL._replace(errors=errors, members=("base", "arm"))))
    line = json.loads(pipe.read())
    assert line["header"]["frame_id"] == MSG.handle
    assert line.get("error_code", 2001) == 2001
    assert line.get("error_codes", [2001, 3005]) == [2001, 3005]
    assert not {"members", "errors"} & line.keys()


def test_each_handle_has_its_own_seq_and_a_negative_age_is_zero(pipe: Pipe) -> None:
    publisher = on(pipe)
    for handle, age in (("a", -0.01), ("b", None), ("a", 1.0)):
        publisher.publish(MSG._replace(handle=handle, heartbeat_age=age))
    lines = [json.loads(line) for line in pipe.read().splitlines()]
    assert [(x["handle"], x["seq"], x["link"]["heartbeat_age"]) for x in lines] == [
        ("a", 0, 0.0), ("b", 0, None), ("a", 1, 1.0),
    ]  # fmt: skip


def test_a_new_status_or_detail_replaces_the_cached_body(pipe: Pipe) -> None:
    publisher = on(pipe)
    publisher.publish(MSG)
    publisher.publish(MSG._replace(status=RobotStatus()))
    publisher.publish(MSG._replace(status=RobotStatus(), detail=Detail(link=LinkState.LOST)))
    modes = [(json.loads(x)["mode"], json.loads(x)["link"]["state"]) for x in pipe.read().splitlines()]
    assert modes == [("AUTO", "CONNECTED"), ("UNKNOWN", "CONNECTED"), ("UNKNOWN", "LOST")]


def test_a_full_pipe_is_busy_and_resumes_where_it_stopped(pipe: Pipe) -> None:
    publisher = on(pipe)
    long_text = ErrorCause(1, "X", "x" * 10_000, STAMP)
    msg = MSG._replace(detail=DETAIL._replace(errors=(long_text,)))
    published = 0
    while not publisher.busy():
        publisher.publish(msg)
        published += 1
        assert published < 100
    assert publisher.service(NOW) == pytest.approx(NOW.mono + 0.005)
    data = pipe.read()
    while publisher.service(NOW) is not None:
        data += pipe.read()
    data += pipe.read()
    assert not publisher.busy()
    assert [json.loads(line)["seq"] for line in data.splitlines()] == list(range(published))
    assert max(map(len, data.splitlines())) > PIPE_BUF


def test_a_closed_reader_is_noticed_when_writing_and_when_idle(pipe: Pipe) -> None:
    publisher = on(pipe)
    assert publisher.service(NOW) is None
    pipe.leave()
    with pytest.raises(BrokenPipeError):
        publisher.busy()
    assert publisher.service(Instant(NOW.mono + 0.5, 0)) is None  # not checked each time
    with pytest.raises(BrokenPipeError):
        publisher.service(Instant(NOW.mono + 1.0, 0))


def test_a_replay_loses_no_line_and_flushes_at_the_end(pipe: Pipe) -> None:
    publisher = on(pipe, patient=True)
    for _ in range(50):
        assert not publisher.busy()
        publisher.publish(MSG)
    publisher.close()
    assert len(pipe.read().splitlines()) == 50


def test_a_file_is_appended_to_and_closed(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    for _ in range(2):
        publisher = JsonLinesPublisher(PublisherContext({"path": str(path)}, Port(), io.StringIO()))
        publisher.publish(MSG)
        publisher.close()
    assert len(path.read_text("utf-8").splitlines()) == 2


def test_a_replay_on_a_full_disk_is_a_link_error() -> None:
    publisher = to_file("/dev/full", patient=True)
    publisher.publish(MSG)
    with pytest.raises(LinkError, match="cannot write JSON lines to /dev/full: No space left on device"):
        publisher.close()


def to_file(path: object, patient: bool = False, **options: Any) -> JsonLinesPublisher:
    return JsonLinesPublisher(PublisherContext({"path": str(path), **options}, Port(), io.StringIO(), patient))


@contextlib.contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file of this process grows beyond `size` bytes (EFBIG)."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def at(seconds: float) -> Instant:
    return Instant(NOW.mono + seconds, STAMP)


def test_a_file_that_cannot_grow_has_whole_lines_only_and_grows_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "lines"
    publisher = to_file(path)
    publisher.publish(MSG)
    whole = path.stat().st_size
    with room_for(whole + 100):
        for _ in range(3):
            assert not publisher.busy()
            publisher.publish(MSG)
            assert publisher.service(at(0.0)) == at(RETRY_FAILED).mono
            assert path.stat().st_size == whole
    assert publisher.service(at(RETRY_FAILED - 0.1)) == at(RETRY_FAILED).mono
    assert publisher.service(at(RETRY_FAILED)) is None
    publisher.publish(MSG._replace(handle="other"))
    publisher.close()
    lines = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    assert [(line["handle"], line["seq"]) for line in lines] == [("robot", 0), ("robot", 3), ("other", 0)]
    assert publisher.dropped == 2
    assert caplog.messages == [
        f"cannot write JSON lines to {path}: File too large; trying again",
        f"writing {path} again; 2 lines are not in it",
    ]


def test_the_last_line_of_each_robot_waits_for_the_disk(tmp_path: Path) -> None:
    """With changes only, the file would otherwise show an old status for hours."""
    path = tmp_path / "lines"
    path.symlink_to("/dev/full")
    publisher = to_file(path, changes_only=True)
    for handle in ("a", "b", "a"):
        publisher.publish(MSG._replace(handle=handle))
    publisher.service(NOW)
    path.unlink()
    assert publisher.service(at(RETRY_FAILED)) is None
    written = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    assert {(line["handle"], line["seq"]) for line in written} == {("a", 1), ("b", 0)}


def test_a_disk_that_fails_again_and_again_is_told_once_a_minute(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "lines"
    full = tmp_path / "full"
    full.symlink_to("/dev/full")
    path.symlink_to(full)
    publisher = to_file(path)
    for turn in range(24):
        target = full if turn % 2 == 0 else tmp_path / "room"
        path.unlink()
        path.symlink_to(target)
        if publisher.queued == 0:
            publisher._output._close()  # type: ignore[union-attr]
            publisher._output._open()  # type: ignore[union-attr]
        publisher.publish(MSG)
        publisher.service(at(turn * RETRY_FAILED))
    told = [message for message in caplog.messages if message.startswith("cannot write")]
    assert len(told) == 2  # in two minutes


def test_a_file_that_ends_with_half_a_line_gets_a_newline_first(tmp_path: Path) -> None:
    for patient in (False, True):
        path = tmp_path / f"lines {patient}"
        path.write_text('{"stamp": "20')
        publisher = to_file(path, patient)
        publisher.publish(MSG)
        publisher.close()
        torn, line = path.read_text("utf-8").splitlines()
        assert torn == '{"stamp": "20'
        assert json.loads(line)["seq"] == 0


def test_a_fifo_that_nobody_reads_yet_gets_lines_from_its_first_reader_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "fifo"
    os.mkfifo(path)
    publisher = to_file(path)
    for turn in range(3):
        assert not publisher.busy()
        publisher.publish(MSG)
        publisher.service(at(turn * RETRY_FAILED))
    assert caplog.messages == [f"cannot write JSON lines to {path}: nobody reads this pipe yet; trying again"]
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    publisher.service(at(3 * RETRY_FAILED))
    publisher.publish(MSG)
    assert [json.loads(line)["seq"] for line in os.read(reader, 1 << 16).splitlines()] == [2, 3]
    assert caplog.messages[1:] == [f"writing {path} again; 2 lines are not in it"]
    os.close(reader)
    publisher.close()


def test_a_replay_says_that_nobody_reads_its_fifo(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(LinkError, match="nobody reads this pipe yet"):
        to_file(tmp_path / "fifo", patient=True)


def test_a_fifo_whose_reader_leaves_waits_for_the_next_one(tmp_path: Path) -> None:
    path = tmp_path / "fifo"
    os.mkfifo(path)
    first = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    publisher = to_file(path)
    publisher.publish(MSG)
    os.close(first)
    for turn in range(3):
        assert not publisher.busy()
        publisher.publish(MSG)
        publisher.service(at(turn * RETRY_FAILED))
    second = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    publisher.service(at(3 * RETRY_FAILED))
    assert [json.loads(line)["seq"] for line in os.read(second, 1 << 16).splitlines()] == [3]
    os.close(second)
    publisher.close()


def test_standard_output_on_a_full_disk_is_tried_again(tmp_path: Path) -> None:
    """A shell opened it without O_APPEND. Half a line is completed first."""
    path = tmp_path / "lines"
    with path.open("w", encoding="utf-8") as stdout:
        publisher = JsonLinesPublisher(PublisherContext({}, Port(), stdout))
        with room_for(100):
            for _ in range(3):
                publisher.publish(MSG)
                publisher.service(NOW)
        publisher.service(at(RETRY_FAILED))
        publisher.publish(MSG)
        publisher.close()
    assert [json.loads(line)["seq"] for line in path.read_text("utf-8").splitlines()] == [0, 2, 3]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"format": "xml"}, "json: format: must be one of native, ros1, ros2, not 'xml'"),
        ({"colour": 1}, "unknown option 'colour'"),
    ],
)
def test_wrong_options_are_usage_errors(pipe: Pipe, options: dict[str, Any], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        on(pipe, **options)


def test_changes_only_is_not_periodic(pipe: Pipe) -> None:
    assert on(pipe).periodic
    assert not on(pipe, changes_only=True).periodic
