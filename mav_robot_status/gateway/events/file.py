"""Reads the table of PX4's events that a configuration names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import UsageError
from ...hardware.mavlink.px4_events.parsing import MOST_BYTES, TableError, parse

if TYPE_CHECKING:
    from ...config import Config
    from ...hardware.mavlink.px4_events import EventTable


def event_table(config: Config) -> EventTable | None:
    """The table in the file of the option `px4_events`; None without that option.

    Raises UsageError: one line with the name of the file.
    """
    path = config.hardware.px4_events
    if path is None:
        return None
    try:
        with open(path, "rb") as file:
            return parse(file.read(MOST_BYTES + 1))
    except OSError as error:
        raise UsageError(f"px4_events: cannot read {path!r}: {error.strerror}") from None
    except TableError as error:
        raise UsageError(f"px4_events: {path!r} cannot be used: {error}") from None
    except ValueError as error:  # a NUL in the name
        raise UsageError(f"px4_events: cannot read {path!r}: {error}") from None
