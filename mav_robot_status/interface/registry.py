"""Where handles are registered and found: ros_control's interface and interface manager."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import TypeVar

from ..errors import MavRobotStatusError, UnknownHandleError
from .handle import IndustrialRobotStatusHandle

log = logging.getLogger(__name__)

T = TypeVar("T")


class IndustrialRobotStatusInterface:
    """The handles of one hardware interface, by name."""

    def __init__(self) -> None:
        self._handles: dict[str, IndustrialRobotStatusHandle] = {}
        self.version = 0
        """Changes with every handle that is registered or removed."""

    def __len__(self) -> int:
        return len(self._handles)

    def __iter__(self) -> Iterator[IndustrialRobotStatusHandle]:
        return iter(self._handles.values())

    def register_handle(self, handle: IndustrialRobotStatusHandle) -> None:
        """Register a handle. A second registration of a name replaces the first, with a warning in the log."""
        if handle.name in self._handles:
            log.warning("replacing the handle '%s', which was registered before", handle.name)
        self._handles[handle.name] = handle
        self.version += 1

    def remove_handle(self, name: str) -> None:
        """Remove a handle: its robot is gone for good. ORIGINAL: ros_control never removes one."""
        del self._handles[name]
        self.version += 1

    def get_handle(self, name: str) -> IndustrialRobotStatusHandle:
        """The handle of that name. Raises UnknownHandleError, which lists the registered names."""
        try:
            return self._handles[name]
        except KeyError:
            names = ", ".join(f"'{n}'" for n in self._handles) or "none"
            raise UnknownHandleError(f"there is no handle '{name}'; registered: {names}") from None

    def get_names(self) -> list[str]:
        """The names of the registered handles, in the order of their registration."""
        return list(self._handles)


class InterfaceManager:
    """The interfaces that a hardware interface offers, found by their type."""

    def __init__(self) -> None:
        self._interfaces: dict[type[object], object] = {}

    def register_interface(self, interface: object) -> None:
        """Offer an interface. A second one of the same type replaces the first, with a warning in the log."""
        if type(interface) in self._interfaces:
            log.warning("replacing the interface %s, which was registered before", type(interface).__name__)
        self._interfaces[type(interface)] = interface

    def get(self, kind: Callable[[], T]) -> T:
        """The interface of that type. Raises MavRobotStatusError if there is none."""
        interface = self._interfaces.get(kind)  # type: ignore[call-overload]
        if interface is None:
            wanted = getattr(kind, "__name__", kind)
            raise MavRobotStatusError(f"this hardware offers no {wanted}")
        return interface  # type: ignore[no-any-return]
