"""How the gateway behaves among others on a link."""

from __future__ import annotations

import time
from collections.abc import Callable

from mav_robot_status.testing import FakeAutopilot, ardurover
from tests.pymavlink_dialect import (
    MAVLink_attitude_message,
    MAVLink_command_long_message,
    MAVLink_heartbeat_message,
)

from ..deadline import Deadline, in_time, wait_until
from .gateway_process import Gateway
from .wire import Wire

SET_INTERVAL, GET_INTERVAL, REQUEST_MESSAGE, ROBOT_STATUS = 511, 510, 512, 59900
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
SLOW = {2, 36, 74, 245}
"""Messages that the gateway asks a rover for, and that come too rarely by themselves."""

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]


def command(number: int, *params: float, system: int = 1, component: int = 192) -> MAVLink_command_long_message:
    padded = [*params, *[0.0] * (7 - len(params))]
    return MAVLink_command_long_message(system, component, number, 0, *padded)


def test_a_consumer_changes_the_rate_of_the_status_for_itself_alone(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    eager, calm = wire(gate.address, system=1).beating(), wire(gate.address, system=2).beating()
    for peer in (eager, calm):
        peer.wait_for("ROBOT_STATUS")
    asked = time.monotonic()
    eager.send(command(SET_INTERVAL, ROBOT_STATUS, 200_000))
    assert eager.wait_for("COMMAND_ACK").message.result == ACCEPTED
    eager.send(command(GET_INTERVAL, ROBOT_STATUS))
    assert eager.wait_for("MESSAGE_INTERVAL").message.interval_us == 200_000
    took = eager.wait_for("ROBOT_STATUS", lambda m: m.subject_system == 1, after=asked, count=15).at - asked
    assert took > 15 / 6.5  # at 5 Hz
    assert in_time(took, 15 / 3.5)
    untouched = [h for h in calm.heard("ROBOT_STATUS") if h.message.subject_system == 1 and h.at > asked]
    assert len(untouched) <= 2 * (time.monotonic() - asked)  # at 1 Hz
    assert gate.stop() == 0


def test_a_consumer_without_a_stream_can_request_one_status(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    peer = wire(gate.address).beating()
    peer.wait_for("ROBOT_STATUS")
    peer.send(command(SET_INTERVAL, ROBOT_STATUS, -1))
    silent_from = peer.wait_for("COMMAND_ACK", lambda m: m.command == SET_INTERVAL).at
    peer.wait_for("HEARTBEAT", after=silent_from, count=3)  # one a second, as ROBOT_STATUS was
    assert not [h for h in peer.heard("ROBOT_STATUS") if h.at > silent_from]
    peer.send(command(REQUEST_MESSAGE, ROBOT_STATUS))
    peer.wait_for("ROBOT_STATUS", after=silent_from)
    assert peer.wait_for("COMMAND_ACK", lambda m: m.command == REQUEST_MESSAGE).message.result == ACCEPTED
    for number, params, result in ((400, (1.0,), UNSUPPORTED), (SET_INTERVAL, (30.0, 1000.0), DENIED)):
        after = time.monotonic()
        peer.send(command(number, *params))
        assert peer.wait_for("COMMAND_ACK", after=after).message.result == result
    assert gate.stop() == 0


def test_unknown_senders_and_commands_for_others_get_no_answer(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    peer, stranger = wire(gate.address).beating(), wire(gate.address, system=250)
    peer.wait_for("ROBOT_STATUS")
    stranger.send(command(REQUEST_MESSAGE, ROBOT_STATUS))
    peer.send(command(REQUEST_MESSAGE, ROBOT_STATUS, component=0))
    peer.send(command(REQUEST_MESSAGE, ROBOT_STATUS, component=1))
    peer.send(command(GET_INTERVAL, ROBOT_STATUS))
    peer.wait_for("MESSAGE_INTERVAL")
    peer.wait_for("HEARTBEAT", after=time.monotonic())
    assert {h.message.command for h in peer.heard("COMMAND_ACK")} <= {GET_INTERVAL}
    assert not stranger.heard()
    assert gate.stop() == 0


def asked_for(rover: FakeAutopilot) -> set[int]:
    """The messages whose interval the gateway has set."""
    ours = (m for m in rover.heard("COMMAND_LONG") if m.get_srcComponent() == 192)
    return {int(m.param1) for m in ours if m.command == SET_INTERVAL}


def test_no_rate_that_another_program_has_set_is_lowered(
    gateway: StartGateway, autopilot: Callable[..., FakeAutopilot], wire: OpenWire
) -> None:
    """A ground station on the same channel, through us, has set its rates; then we ask for ours."""
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward", "--json", "none")
    rover = autopilot(ardurover.READY, gate.address)
    ground = wire(("127.0.0.1", gate.ports(2)[1]), system=255, component=190)
    ground.send(MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    ground.wait_for("HEARTBEAT", lambda m: m.get_srcComponent() == 1)
    fast = {30: 20.0, 33: 10.0, 1: 5.0}
    for message_id, hertz in fast.items():
        ground.send(command(SET_INTERVAL, message_id, 1e6 / hertz, component=1))
    ground.wait_for("ATTITUDE")
    wait_until(lambda: asked_for(rover) >= SLOW)
    now = time.monotonic()
    assert in_time(ground.wait_for("ATTITUDE", after=now, count=40).at - now, 3.0)
    assert not asked_for(rover) & set(fast)
    ours = [m for m in rover.heard("COMMAND_LONG") if m.get_srcComponent() == 192]
    assert {m.command for m in ours} <= {SET_INTERVAL, GET_INTERVAL, REQUEST_MESSAGE}
    assert gate.stop() == 0


def test_two_vehicles_with_one_id_are_an_error_with_their_addresses(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--changes-only")
    north, south = wire(gate.address), wire(gate.address)
    south.mav.seq = 100
    for rover in (north, south):
        rover.beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    start, deadline = time.monotonic(), Deadline()
    while not any(line.status["error_code"] == 9002 for line in gate.lines):
        assert deadline.left
        for rover, booted in ((north, 1_000_000), (south, 60_000)):
            clock = booted + int((time.monotonic() - start) * 1000)
            rover.send(MAVLink_attitude_message(clock, 0, 0, 0, 0, 0, 0))
        time.sleep(0.1)
    line = gate.wait_for(lambda s: s["error_code"] == 9002)
    assert line.status["in_error"] is True
    assert line.status["errors"][0]["name"] == "SYSTEM_ID_CONFLICT"
    told = gate.wait_for_log(r"two autopilots use the ids 1\.1: (\S+):(\d+).* and (\S+):(\d+)")
    assert {int(told[2]), int(told[4])} == {north.address[1], south.address[1]}
    assert gate.stop() == 0


def test_one_vehicle_on_two_links_is_one_vehicle_and_either_link_may_fail(
    gateway: StartGateway, wire: OpenWire
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "udpin:127.0.0.1:0")
    first, second = (wire(("127.0.0.1", port)) for port in gate.ports(2))
    clock_start = time.monotonic()

    def send(armed: bool, wires: tuple[Wire, ...]) -> None:
        """Heartbeats on these links, until the lines say so and five more times."""
        left, deadline = 5, Deadline()
        while left:
            assert deadline.left, gate.lines[-2:]
            for one in wires:
                one.beat(armed=armed)
                one.send(MAVLink_attitude_message(int((time.monotonic() - clock_start) * 1000), 0, 0, 0, 0, 0, 0))
            left -= bool(gate.lines) and gate.lines[-1].status["drives_powered"] is armed
            time.sleep(0.2)

    for armed, wires in ((False, (first, second)), (True, (second,)), (False, (first, second)), (True, (first,))):
        send(armed, wires)
    assert {line.status["handle"] for line in gate.lines} == {"industrial_robot_status_handle"}
    assert not any(line.status["link"]["state"] == "LOST" for line in gate.lines)
    # while one link says armed and the other one, silent for less than 1.5 s, disarmed: unknown
    states = [s for line in gate.lines if (s := line.status["drives_powered"]) is not None]
    assert [s for n, s in enumerate(states) if n == 0 or s != states[n - 1]] == [False, True, False, True]
    assert not any(line.status["in_error"] for line in gate.lines)
    assert gate.stop() == 0
    assert any("duplicate frames" in line for line in gate.log)
