"""What the installed command sends on MAVLink, and what it requests."""

from __future__ import annotations

import contextlib
import importlib.util
import shutil
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from pymavlink import dialects
from pymavlink.generator import mavgen

from mav_robot_status.testing import FakeAutopilot, arducopter, ardurover
from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

from ..deadline import in_time, wait_until
from ..ports import free_port
from .gateway_process import Gateway
from .wire import Heard, Wire

XML = Path(__file__).parents[2] / "dialects" / "mav_robot_status.xml"


class Conversation(NamedTuple):
    """Some seconds of a rover with one change: what each end received from the gateway."""

    rover: list[Any]
    out: list[Any]
    changed_at: float


@pytest.fixture(scope="module")
def conversation() -> Iterator[Conversation]:
    with contextlib.ExitStack() as stack:
        out = stack.enter_context(contextlib.closing(Wire()))
        gate = stack.enter_context(
            contextlib.closing(Gateway("udpin:127.0.0.1:0", "--out", f"udpout:127.0.0.1:{out.address[1]}"))
        )
        rover = stack.enter_context(contextlib.closing(Wire(gate.address, system=42)))
        rover.beat()
        rover.beating()
        first = rover.wait_for("ROBOT_STATUS")
        rover.wait_for("ROBOT_STATUS", after=first.at + 0.2, count=3)
        changed_at = rover.beat(armed=True, custom_mode=10)
        rover.wait_for("ROBOT_STATUS", lambda m: m.drives_powered == 1)
        out.wait_for("ROBOT_STATUS", lambda m: m.drives_powered == 1)
        rover.wait_for("HEARTBEAT", after=changed_at)
        assert gate.stop() == 0
        yield Conversation(rover.heard(), out.heard(), changed_at)


def kind(heard: list[Any], name: str) -> list[Any]:
    return [h for h in heard if h.message.get_type() == name]


def test_our_heartbeat_is_a_companions_beside_the_autopilot(conversation: Conversation) -> None:
    beats = kind(conversation.rover, "HEARTBEAT")
    assert len(beats) >= 3
    for beat in beats:
        m = beat.message
        assert (m.get_srcSystem(), m.get_srcComponent()) == (42, 192)
        assert (m.type, m.autopilot, m.base_mode) == (18, 8, 0)
    periods = [b.at - a.at for a, b in pairwise(beats)]
    assert in_time(abs(sum(periods) / len(periods) - 1.0), 0.15)


def test_robot_status_comes_once_a_second_and_with_each_change(conversation: Conversation) -> None:
    statuses = kind(conversation.rover, "ROBOT_STATUS")
    before = [h.at for h in statuses if h.at < conversation.changed_at and h.at > statuses[0].at + 0.2]
    assert in_time(abs(before[2] - before[0] - 2.0), 0.2)
    changed = next(h for h in statuses if h.message.drives_powered == 1)
    assert in_time(changed.at - conversation.changed_at, 0.2)


def _said(statuses: list[Heard]) -> list[dict[str, Any]]:
    """What was said, each thing once; when is another matter, for each end has a schedule of its own."""
    told = [{k: v for k, v in h.message.to_dict().items() if k != "time_usec"} for h in statuses]
    return [one for n, one in enumerate(told) if n == 0 or one != told[n - 1]]


def test_an_out_receives_the_same(conversation: Conversation) -> None:
    there, here = (_said(kind(end, "ROBOT_STATUS")) for end in (conversation.out, conversation.rover))
    assert there == here[-len(there) :]
    assert kind(conversation.out, "HEARTBEAT")


def test_a_dialect_that_pymavlink_generates_from_our_xml_reads_robot_status(
    conversation: Conversation, tmp_path: Path
) -> None:
    public = Path(dialects.__file__ or "").parent / "v20"
    for xml in (public / "common.xml", public / "standard.xml", public / "minimal.xml", XML):
        shutil.copy(xml, tmp_path)  # as a user does: beside the files that it includes
    output = tmp_path / "generated.py"
    options = mavgen.Opts(str(output), wire_protocol="2.0", language="Python3", validate=False)
    mavgen.mavgen(options, [str(tmp_path / XML.name)])
    spec = importlib.util.spec_from_file_location("generated", output)
    assert spec is not None
    assert spec.loader is not None
    generated = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generated)
    parser = generated.MAVLink(None)
    (first,) = parser.parse_buffer(kind(conversation.rover, "ROBOT_STATUS")[0].data)
    (last,) = parser.parse_buffer(
        next(h for h in kind(conversation.rover, "ROBOT_STATUS") if h.message.drives_powered == 1).data
    )
    assert (first.get_msgId(), first.get_type()) == (59900, "ROBOT_STATUS")
    assert (first.get_srcSystem(), first.get_srcComponent()) == (42, 192)
    assert (first.subject_system, first.subject_component) == (42, 1)
    assert (first.mode, first.e_stopped, first.drives_powered, first.in_motion) == (1, -1, 0, -1)
    assert first.inhibit_flags & 2  # DISARMED
    assert (last.mode, last.drives_powered, last.error_code) == (2, 1, 0)
    assert abs(last.time_usec / 1e6 - time.time()) < 120


def test_passive_sends_nothing_to_the_vehicle_and_everything_to_the_out(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    out = wire()
    gate = gateway("udpin:127.0.0.1:0", "--passive", "--out", f"udpout:127.0.0.1:{out.address[1]}")
    rover = wire(gate.address).beating()
    out.wait_for("ROBOT_STATUS")
    out.wait_for("HEARTBEAT")
    out.wait_for("ROBOT_STATUS", after=time.monotonic(), count=2)
    assert rover.heard() == []


def test_before_the_first_vehicle_only_a_link_that_must_send_first_sends(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    vehicle, out = wire(), wire()
    gateway(f"127.0.0.1:{vehicle.address[1]}", "--system", "1", "--out", f"127.0.0.1:{out.address[1]}")
    lonely = vehicle.wait_for("HEARTBEAT").message
    assert (lonely.get_srcSystem(), lonely.get_srcComponent()) == (245, 192)
    vehicle.wait_for("HEARTBEAT", after=time.monotonic(), count=2)
    assert {h.message.get_type() for h in vehicle.heard()} == {"HEARTBEAT"}
    assert out.heard() == []


def test_missing_messages_are_requested_one_command_at_a_time(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], tmp_path: Path
) -> None:
    """Beside it run those that must not ask: what flows, on a passive link, with `requests: none`."""
    streams = {1: 2.0, 245: 2.0, 33: 4.0, 30: 4.0, 2: 1.0, 36: 2.0, 74: 2.0, 193: 0.5}
    config = tmp_path / "none.yaml"
    config.write_text('links: ["udpin:127.0.0.1:0"]\nrequests: none\n')
    variants = (
        ("udpin:127.0.0.1:0",),
        ("udpin:127.0.0.1:0",),
        ("--config", str(config)),
        ("udpin:127.0.0.1:0", "--passive"),
    )
    gates = [gateway(*arguments) for arguments in variants]
    silent = autopilot(arducopter.READY, gates[0].address)
    flowing = autopilot(ardurover.READY._replace(streams=streams), gates[1].address)
    unasked = autopilot(arducopter.READY, gates[2].address)
    unheard = autopilot(arducopter.READY, gates[3].address)
    first = gates[0].wait_for(lambda s: s["link"]["state"] == "CONNECTED")
    assert first.status["motion_possible"] is None or "SYS_STATUS_MISSING" in str(first.status["inhibits"])
    gates[0].wait_for_log("requesting from vehicle 1.1")
    assert in_time(abs(time.monotonic() - first.at - 3.0), 0.5)
    gates[0].wait_for(lambda s: s["in_motion"] is False and s["in_error"] is False)
    wait_until(lambda: {int(c.param1) for c in silent.heard("COMMAND_LONG")} >= set(streams))
    commands = silent.heard("COMMAND_LONG")
    assert {c.command for c in commands} == {510, 511}
    assert [c.confirmation for c in commands] == [0] * len(commands)  # each was acknowledged in time
    assert {int(c.param1) for c in commands} == set(streams)
    assert all(c.get_srcSystem() == 1 and c.get_srcComponent() == 192 for c in commands)
    assert flowing.heard("HEARTBEAT")
    assert {(c.command, c.param1) for c in flowing.heard("COMMAND_LONG")} <= {(512, 148)}  # AUTOPILOT_VERSION, once
    assert unasked.heard("COMMAND_LONG") == unheard.heard() == []
    assert not any("requesting" in line for gate in gates[1:] for line in gate.log)


def test_commands_wait_for_the_acknowledgement_of_the_one_before(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    asked = rover.wait_for("COMMAND_LONG")
    rover.wait_for("COMMAND_LONG", lambda m: m.confirmation == 1)
    commands = [h.message for h in rover.heard("COMMAND_LONG")]
    assert {c.param1 for c in commands} == {asked.message.param1}
    assert asked.at - rover.beats[0] > 2.5
    assert in_time(asked.at - rover.beats[0] - 3.0, 0.5)
    acknowledged = time.monotonic()
    rover.send(MAVLink(None).command_ack_encode(511, 0, 0, 0, 1, 192))
    following = rover.wait_for("COMMAND_LONG", lambda m: m.param1 != asked.message.param1)
    assert in_time(following.at - acknowledged, 0.9)


def test_we_take_the_next_component_id_if_another_program_has_ours_but_not_for_an_echo(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    for number in (1, 2):
        rover.send(rover.wait_for("HEARTBEAT", count=number).data)
    third = rover.wait_for("HEARTBEAT", after=time.monotonic(), count=2)
    assert third.message.get_srcComponent() == 192
    wire(gate.address, component=192).send(MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    gate.wait_for_log("another program uses the ids 1/192: changing to component 193")
    rover.wait_for("HEARTBEAT", lambda m: m.get_srcComponent() == 193)
    rover.wait_for("ROBOT_STATUS", lambda m: m.get_srcComponent() == 193)


def test_a_port_that_refuses_does_not_stop_the_gateway(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire]
) -> None:
    port = free_port()
    gate = gateway("udpin:127.0.0.1:0", "--out", f"127.0.0.1:{port}")
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["seq"] > 5)
    rover.beat(armed=True)
    gate.wait_for(lambda s: s["drives_powered"] is True)
