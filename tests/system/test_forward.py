"""Pass-through: one process serves flight controller, ground station and status."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mav_robot_status.testing import FakeAutopilot, ardurover
from tests.pymavlink_dialect import MAVLink_command_long_message, MAVLink_heartbeat_message

from .gateway_process import Gateway
from .wire import Wire

GCS, INVALID = 6, 8
ARM_DISARM, ACCEPTED = 400, 0
UNKNOWN_KIND = bytes([0xFD, 3, 0, 0, 7, 1, 1, 0x01, 0x00, 0x7A]) + b"abc" + b"\x01\x02"

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]


def endpoint(wire: OpenWire, gate: Gateway) -> Wire:
    """A ground station on the gateway's second port."""
    ground = wire(("127.0.0.1", gate.ports(2)[1]), system=255, component=190)
    ground.send(MAVLink_heartbeat_message(GCS, INVALID, 0, 0, 4, 3))
    return ground


def test_a_ground_station_hears_the_vehicle_and_the_status_and_commands_it_through_us(
    gateway: StartGateway, wire: OpenWire, autopilot: Callable[..., FakeAutopilot]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward")
    ground = endpoint(wire, gate)
    rover = autopilot(ardurover.READY, gate.address)
    beat = ground.wait_for("HEARTBEAT", lambda m: m.get_srcComponent() == 1)
    assert beat.message.type == 10
    ground.wait_for("SYS_STATUS")
    ground.wait_for("ROBOT_STATUS")
    ground.send(MAVLink_command_long_message(1, 1, ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0))
    assert ground.wait_for("COMMAND_ACK").message.result == ACCEPTED
    gate.wait_for(lambda s: s["drives_powered"] is True)
    assert any(m.get_srcSystem() == 255 for m in rover.heard("COMMAND_LONG"))
    assert gate.stop() == 0


def test_datagrams_are_forwarded_unchanged_even_with_unknown_messages(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward")
    ground = endpoint(wire, gate)
    rover = wire(gate.address).beating()
    ground.wait_for("HEARTBEAT", lambda m: m.get_srcComponent() == 1)
    frame = MAVLink_heartbeat_message(10, 3, 65, 77, 4, 3).pack(rover.mav)
    rover.send(UNKNOWN_KIND + frame)
    found = ground.wait_for("HEARTBEAT", lambda m: m.custom_mode == 77)
    assert found.data == UNKNOWN_KIND + frame
    assert gate.stop() == 0


def of_the_autopilot(system: int) -> Callable[[Any], bool]:
    return lambda message: (message.get_srcSystem(), message.get_srcComponent()) == (system, 1)


def test_a_command_goes_only_to_the_link_of_its_target_and_nothing_returns_to_its_sender(
    gateway: StartGateway, wire: OpenWire
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward")
    ground = endpoint(wire, gate)
    one, two = wire(gate.address, system=1).beating(), wire(gate.address, system=2).beating()
    for system in (1, 2):
        ground.wait_for("HEARTBEAT", of_the_autopilot(system))
    ground.send(MAVLink_command_long_message(2, 1, ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0))
    two.wait_for("COMMAND_LONG", lambda m: m.command == ARM_DISARM)
    ground.send(MAVLink_heartbeat_message(GCS, INVALID, 0, 5, 4, 3))
    one.wait_for("HEARTBEAT", lambda m: m.custom_mode == 5)
    assert not [h for h in one.heard("COMMAND_LONG") if h.message.command == ARM_DISARM]
    assert not [h for h in ground.heard() if h.message.get_srcSystem() == 255]
    assert not [h for h in one.heard("HEARTBEAT") if h.message.get_srcComponent() == 1]
    assert gate.stop() == 0


def test_without_the_option_nothing_is_forwarded(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0")
    ground = endpoint(wire, gate)
    wire(gate.address).beating()
    ground.wait_for("ROBOT_STATUS")
    ground.wait_for("NAMED_VALUE_INT")
    assert {h.message.get_srcComponent() for h in ground.heard()} == {192}
    assert gate.stop() == 0
