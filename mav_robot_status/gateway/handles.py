"""Which handle a publisher serves, if it serves only one; and a warning of a vehicle whose handle nobody reads."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from ..interface import DEFAULT_HANDLE_NAME
from . import plugins
from .controller_config import DEFAULT_CONTROLLER, handle_name, is_default, publisher_key, publishers_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..config import Config, ControllerConfig, PublisherConfig

log = logging.getLogger(__name__)


class SingleHandles:
    """The handle of each publisher that serves only one, because its receivers cannot tell whose status they get.

    It is the handle of the first controller with the publisher.
    The default controller runs on every handle. Its publishers serve the first handle of the configuration.
    """

    def __init__(self, config: Config) -> None:
        """Raises ConfigError for an unknown publisher."""
        self._handles: dict[tuple[str, str], str] = {}
        self._told: set[str] = set()
        for controller in config.controllers or (DEFAULT_CONTROLLER,):
            name = _first_handle(config) if is_default(controller) else handle_name(controller)
            for publisher in publishers_of(controller):
                if plugins.declares(plugins.load(plugins.PUBLISHERS, publisher.type, controller.where), "one_handle"):
                    self._handles.setdefault(publisher_key(publisher), name)

    def serves(self, publisher: PublisherConfig, controller: ControllerConfig) -> bool:
        """Whether a publisher serves the handle of a controller. The log names the first that it does not serve."""
        handle = handle_name(controller)
        only = self._handles.get(publisher_key(publisher), handle)
        if only != handle and publisher.type not in self._told:
            self._told.add(publisher.type)
            log.warning(
                "%s serves one handle, '%s', and not '%s': choose another with --system N, or give each handle a "
                "controller and a %s of its own",
                publisher.type, only, handle, publisher.type,
            )  # fmt: skip
        return only == handle


def _first_handle(config: Config) -> str:
    if config.vehicles:
        return config.vehicles[0].handle
    return DEFAULT_HANDLE_NAME if config.hears_mavlink else config.interfaces[0].name


class UnreadHandles:
    """The handles that vehicles get by their ids, and that no controller reads.

    A controller without `handle_name` reads the handle of vehicle 1.1. A vehicle with other ids then has no status.
    """

    def __init__(self, controllers: Sequence[ControllerConfig]) -> None:
        """`controllers`: those of the configuration, or the default one, which reads every handle."""
        every = any(is_default(controller) for controller in controllers)
        self._read = {handle_name(controller) for controller in controllers}
        self._tells = not every and DEFAULT_HANDLE_NAME in self._read

    def note(self, handle: str) -> None:
        """There is a new handle."""
        if not self._tells or handle in self._read or not handle.startswith(f"{DEFAULT_HANDLE_NAME}/"):
            return
        self._tells = False
        ids = handle.rpartition("/")[2]
        log.warning(
            "no controller reads the handle '%s' of vehicle %s: write 'handle_name: %s' in a controller, or "
            "'vehicles: [{system: %s}]' to give the vehicle the handle '%s'",
            handle, ids, handle, ids.partition(".")[0], DEFAULT_HANDLE_NAME,
        )  # fmt: skip
