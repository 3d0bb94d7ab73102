"""Find out why there is no status."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..config import Config, LinkConfig
from ..links.url import parse
from ..publishers.ros.settings import Ros2Options
from ..streams import say
from .options import connections, given, looking, publisher, seconds
from .overrides import configured

if TYPE_CHECKING:
    from ..diagnosis.doctor.onboard import OnboardFindings


def arguments(parser: argparse.ArgumentParser) -> None:
    """The connections and the duration."""
    connections(parser, "what to listen to")
    parser.add_argument(
        "--seconds", type=seconds, metavar="S", default=5.0, help="listen for this long after the first heartbeat (5)"
    )
    parser.add_argument("--as-json", action="store_true", help="as JSON, one object for each connection")
    publisher(parser, Ros2Options)
    looking(parser, "never send anything on the connections")


def run(options: argparse.Namespace) -> int:
    """0: every connection and every arm has a status, and the ROS 2 topics are available; 1: otherwise."""
    from ..diagnosis.doctor import onboard
    from ..diagnosis.doctor.arm_diagnosis import arm_as_json, arm_as_text
    from ..diagnosis.doctor.arms import examine_arm
    from ..diagnosis.doctor.listen import examine
    from ..diagnosis.doctor.rendering import as_json, as_text

    config = configured(options)
    for link in config.links:  # report an invalid connection before listening
        parse(link.url)
    ok = True
    for link in config.links:
        log = _onboard(config, link)
        if log is not None:
            say(*([onboard.as_json(log)] if options.as_json else onboard.as_text(log)))
            continue
        found, diagnosis = examine(config, link, options.seconds)
        ok = ok and diagnosis.ok
        say(*([as_json(found, diagnosis)] if options.as_json else as_text(found, diagnosis)))
    for interface in config.interfaces:
        arm, diagnosis = examine_arm(config, interface, options.seconds)
        ok = ok and diagnosis.ok
        say(*([arm_as_json(arm, diagnosis)] if options.as_json else arm_as_text(arm, diagnosis)))
    if options.ros2 is not None:
        ok = _ros2(options) and ok
    return 0 if ok else 1


def _onboard(config: Config, link: LinkConfig) -> OnboardFindings | None:
    """What an autopilot's own log holds; None for every other connection. Raises UsageError."""
    from ..diagnosis.doctor.onboard import examine
    from ..gateway.logs.onboard_recording import OnboardRecording
    from ..gateway.replay import open_recording

    url = parse(link.url)
    recording = open_recording(url.device) if url.kind.is_log else None
    return examine(config, recording) if isinstance(recording, OnboardRecording) else None


def _ros2(options: argparse.Namespace) -> bool:
    """Whether the ROS 2 topics are available."""
    from ..diagnosis.doctor.ros2 import as_json, as_text, diagnose, examine
    from ..publishers.ros.settings import read

    found = examine(read(given(options, Ros2Options)))
    diagnosis = diagnose(found)
    say(*([as_json(options.ros2, found, diagnosis)] if options.as_json else as_text(found, diagnosis)))
    return diagnosis.ok
