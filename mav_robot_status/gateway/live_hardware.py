"""All hardware interfaces of a live gateway: MAVLink, and those in the list `hardware` of the configuration."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from ..errors import ConfigError, UsageError
from ..hardware.combined import CombinedRobotHW
from ..hardware.group import Group
from ..interface import HardwareContext
from . import plugins
from .guards import as_config_error
from .guards.hardware import GuardedHardware
from .mavlink_hardware import MavlinkHardware

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ..clock import Instant
    from ..config import Config, HardwareConfig
    from ..interface import HardwareInterface
    from .observer import Observer

    Key = tuple[str, str, str]


def open_interface(config: HardwareConfig, *, replay: bool = False, clock: Callable[[], Instant]) -> GuardedHardware:
    """Make a third party's hardware interface. Raises LinkError, and ConfigError with the place."""
    make = plugins.load(plugins.HARDWARE, config.type, config.where)
    context = HardwareContext(config.name, config.options, replay)
    with as_config_error(f"{config.where}: hardware interface '{config.name}'"):
        try:
            return GuardedHardware(make(context), config.name, lambda: clock().mono)
        except UsageError as error:
            raise ConfigError(f"{config.where}: {error}") from None


def combined(config: Config, first: HardwareInterface, others: Iterable[HardwareInterface]) -> HardwareInterface:
    """All interfaces as one, with the groups. MAVLink alone is returned unchanged, to stay fast."""
    parts = (first, *others)
    if len(parts) == 1 and not config.groups:
        return first
    component = config.identity.component
    groups = [Group(name, group.handles, group.fields, component) for name, group in config.groups.items()]
    return CombinedRobotHW(parts, groups)


class LiveHardware:
    """The open hardware interfaces."""

    def __init__(self, config: Config, clock: Callable[[], Instant], observers: Sequence[Observer] = ()) -> None:
        """Open everything but the MAVLink links, see `open`.

        Raises LinkError, ConfigError, UsageError; after an error nothing stays open.
        """
        self._clock = clock
        self._open: dict[Key, GuardedHardware] = {}
        """Third parties' hardware interfaces."""
        self._retired: list[GuardedHardware] = []
        self.config = config
        """The present configuration."""
        with ExitStack() as opened:
            self.mavlink = MavlinkHardware(config, clock, observers, opens=False)
            opened.callback(self._close_all)
            self._open_new(config)
            opened.pop_all()
        self.all = combined(self.config, self.mavlink, self._open.values())
        """All of them as one."""

    def open(self) -> None:
        """Open the MAVLink links, after the outputs: if an output fails, no vehicle hears of us.

        Raises LinkError, UsageError.
        """
        self.mavlink.open()

    def change(self, config: Config) -> None:
        """Open the interfaces that are new in this configuration, and retire those that it lacks.

        Afterwards call `read`, publish, and call `renew`. Raises as the constructor does. After an error some parts
        are closed: change back.
        """
        self.config = config
        for key in self._open.keys() - {_key(interface) for interface in config.interfaces}:
            self._retired.append(self._open.pop(key))
            self._retired[-1].retire()
        self.mavlink.change(config)
        self._open_new(config)

    def renew(self) -> HardwareInterface:
        """Close the retired interfaces. Returns all interfaces of the new configuration as one."""
        while self._retired:
            self._retired.pop().close()
        self.mavlink.renew()
        self.all = combined(self.config, self.mavlink, self._open.values())
        return self.all

    def close(self) -> None:
        """Close everything, even if a part raises."""
        self._close_all()

    def _close_all(self) -> None:
        with ExitStack() as steps:
            steps.callback(self.mavlink.close)
            for interface in (*self._retired, *self._open.values()):
                steps.callback(interface.close)

    def _open_new(self, config: Config) -> None:
        for interface in config.interfaces:
            if _key(interface) not in self._open:
                self._open[_key(interface)] = open_interface(interface, clock=self._clock)


def _key(config: HardwareConfig) -> Key:
    """Identifies an interface: it stays open while its key is the same."""
    return config.type, config.name, repr(sorted(config.options.items()))
