"""Registration and lookup of handles and interfaces."""

from __future__ import annotations

import logging

import pytest

from mav_robot_status.errors import MavRobotStatusError, UnknownHandleError
from mav_robot_status.interface import (
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    InterfaceManager,
)


@pytest.fixture
def interface() -> IndustrialRobotStatusInterface:
    return IndustrialRobotStatusInterface()


def test_a_registered_handle_is_found_by_its_name(interface: IndustrialRobotStatusInterface) -> None:
    handle = IndustrialRobotStatusHandle("rover")
    interface.register_handle(handle)
    assert interface.get_handle("rover") is handle


def test_names_are_listed_in_the_order_of_registration(interface: IndustrialRobotStatusInterface) -> None:
    for name in ("rover", "copter", "arm"):
        interface.register_handle(IndustrialRobotStatusHandle(name))
    assert interface.get_names() == ["rover", "copter", "arm"]


def test_an_unknown_handle_is_an_error_that_lists_the_registered_names(
    interface: IndustrialRobotStatusInterface,
) -> None:
    interface.register_handle(IndustrialRobotStatusHandle("rover"))
    interface.register_handle(IndustrialRobotStatusHandle("copter"))
    with pytest.raises(UnknownHandleError) as caught:
        interface.get_handle("rovre")
    assert str(caught.value) == "there is no handle 'rovre'; registered: 'rover', 'copter'"
    assert caught.value.exit_code == 2


def test_the_error_says_if_no_handle_is_registered(interface: IndustrialRobotStatusInterface) -> None:
    with pytest.raises(UnknownHandleError, match=r"registered: none$"):
        interface.get_handle("rover")


def test_registering_a_name_again_warns_and_replaces(
    interface: IndustrialRobotStatusInterface, caplog: pytest.LogCaptureFixture
) -> None:
    first, second = IndustrialRobotStatusHandle("rover"), IndustrialRobotStatusHandle("rover")
    interface.register_handle(first)
    assert not caplog.records
    interface.register_handle(second)
    assert interface.get_handle("rover") is second
    assert interface.get_names() == ["rover"]
    assert [(r.levelno, r.getMessage()) for r in caplog.records] == [
        (logging.WARNING, "replacing the handle 'rover', which was registered before")
    ]


def test_an_interface_is_found_by_its_type(interface: IndustrialRobotStatusInterface) -> None:
    manager = InterfaceManager()
    manager.register_interface(interface)
    assert manager.get(IndustrialRobotStatusInterface) is interface


def test_an_interface_missing_from_the_hardware_is_an_error_that_names_it() -> None:
    with pytest.raises(MavRobotStatusError, match=r"^this hardware offers no IndustrialRobotStatusInterface$"):
        InterfaceManager().get(IndustrialRobotStatusInterface)


def test_a_hardware_interface_may_offer_interfaces_of_several_types(
    interface: IndustrialRobotStatusInterface,
) -> None:
    class LampInterface:
        """Another interface type."""

    hardware, lamps = InterfaceManager(), LampInterface()
    hardware.register_interface(interface)
    hardware.register_interface(lamps)
    assert hardware.get(IndustrialRobotStatusInterface) is interface
    assert hardware.get(LampInterface) is lamps


def test_registering_a_type_again_warns_and_replaces(
    interface: IndustrialRobotStatusInterface, caplog: pytest.LogCaptureFixture
) -> None:
    manager = InterfaceManager()
    manager.register_interface(IndustrialRobotStatusInterface())
    manager.register_interface(interface)
    assert manager.get(IndustrialRobotStatusInterface) is interface
    assert "replacing the interface IndustrialRobotStatusInterface" in caplog.text
