"""Warns once of a heard vehicle whose handle no controller of the configuration reads."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from ..interface import DEFAULT_HANDLE_NAME
from .controller_config import handle_name, is_default

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..config import ControllerConfig

log = logging.getLogger(__name__)


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
