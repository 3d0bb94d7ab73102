"""MCAP files of the installed command, read by the readers of `mcap` and `rosbags`."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

LOG = pathlib.Path(__file__).parents[1] / "recorded" / "logs" / "ardurover-4.5.6-arm-denied.tlog"


def converted(place: pathlib.Path, *options: str) -> None:
    command = [os.path.join(os.path.dirname(sys.executable), "mav-robot-status"), str(LOG), "--mcap", "status.mcap"]
    subprocess.run([*command, "--json", "status.jsonl", *options], cwd=place, check=True, timeout=60)


def test_a_log_becomes_a_file_with_every_json_line(tmp_path: pathlib.Path) -> None:
    converted(tmp_path)
    with (tmp_path / "status.mcap").open("rb") as file:
        messages = [message.data.decode() for _, _, message in make_reader(file).iter_messages()]
    assert messages == (tmp_path / "status.jsonl").read_text().splitlines(keepends=True)
    assert (tmp_path / "status.mcap").stat().st_size < (tmp_path / "status.jsonl").stat().st_size / 5


def test_rosbags_reads_the_ros2_messages_of_a_log(tmp_path: pathlib.Path) -> None:
    converted(tmp_path, "--mcap-format", "ros2", "--format", "ros2")
    with AnyReader([tmp_path / "status.mcap"]) as reader:
        found = [
            (connection.topic, reader.deserialize(data, connection.msgtype))
            for connection, _, data in reader.messages()
        ]
    lines = len((tmp_path / "status.jsonl").read_text().splitlines())
    statuses = [one for topic, one in found if topic == "/robot_status"]
    assert len(statuses) == lines == len([topic for topic, _ in found if topic == "/diagnostics"])
    assert {one.mode.val for one in statuses} <= {-1, 1, 2}
    assert {one.header.frame_id for one in statuses} == {"industrial_robot_status_handle"}
