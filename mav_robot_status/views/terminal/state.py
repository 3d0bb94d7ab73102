"""The content of the screen as values: the vehicles, the user's selection, and the last lines of the log."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from .text import UNICODE, Glyphs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...clock import Instant

PaneName = Literal["detail", "explain", "transitions", "all transitions", "help"]


class Ui(NamedTuple):
    """The user's selection."""

    handle: str = ""
    """The handle of the selected vehicle. Without a match the first vehicle is selected."""
    pane: PaneName = "detail"
    scroll: int = 0
    """The first visible line of the pane."""


class Change(Protocol):
    """A change of one member of a vehicle's status."""

    @property
    def at(self) -> float:
        """Monotonic seconds."""

    @property
    def stamp(self) -> str:
        """RFC 3339."""

    @property
    def name(self) -> str:
        """A field, `flight_mode`, `link`, `error` or `inhibit`."""

    @property
    def value(self) -> Any:
        """The new value; of an error or inhibit its `name`, `text` and whether it `begins`."""

    @property
    def before(self) -> Any:
        """The previous value; None also for UNKNOWN."""


class Vehicle(NamedTuple):
    """One row."""

    line: Mapping[str, Any]
    """Its status: the members of a native JSON line."""
    age: float | None
    """Seconds since the last heartbeat; None: no heartbeat yet."""
    rates: Mapping[str, float] = {}
    """The rate (Hz) of each message that its status depends on, by name."""

    @property
    def handle(self) -> str:
        """The handle's name."""
        return str(self.line["handle"])

    @property
    def name(self) -> str:
        """`1.1`; the handle while the ids are unknown."""
        system, component = self.line["system"], self.line["component"]
        return self.handle if system is None else f"{system}" if component is None else f"{system}.{component}"

    @property
    def link(self) -> str:
        """The state of its link."""
        return str(self.line["link"]["state"])

    @property
    def has_problem(self) -> bool:
        """Whether it has an error, an emergency stop or no link."""
        return bool(self.line["in_error"] or self.line["e_stopped"] or self.link != "CONNECTED")


class Logged(NamedTuple):
    """A line of the log."""

    unix_us: int
    text: str
    serious: bool = False
    """Whether its level is WARNING or higher."""


class State(NamedTuple):
    """The content of the screen."""

    connection: str
    """The MAVLink connection, as on the command line."""
    now: Instant
    vehicles: tuple[Vehicle, ...] = ()
    ui: Ui = Ui()
    explanation: Mapping[str, Any] | None = None
    """The explanation of the selected vehicle, for its pane; None: not available yet, or no heartbeat yet."""
    changes: tuple[tuple[str, Change], ...] = ()
    """The changes for the pane, each with the name of its vehicle, the latest first."""
    log: tuple[Logged, ...] = ()
    advice: str = ""
    """A remedy, shown until the first heartbeat."""
    glyphs: Glyphs = UNICODE

    @property
    def place(self) -> int:
        """The index of the selected vehicle; 0 without vehicles."""
        return next((i for i, vehicle in enumerate(self.vehicles) if vehicle.handle == self.ui.handle), 0)

    @property
    def chosen(self) -> Vehicle | None:
        """The selected vehicle."""
        return self.vehicles[self.place] if self.vehicles else None


def seconds_since(stamp: str, now: Instant) -> float:
    """Seconds from an RFC 3339 stamp of this computer's clock until now."""
    return now.unix_us / 1e6 - datetime.fromisoformat(stamp.replace("Z", "+00:00")).timestamp()


def duration(seconds: float) -> str:
    """`12s`, `3m`, `5h`, `2d`: at most four characters up to 27 years."""
    whole = max(0, int(seconds))
    for unit, size, most in (("s", 1, 100), ("m", 60, 100), ("h", 3600, 48)):
        if whole < size * most:
            return f"{whole // size}{unit}"
    return f"{whole // 86400}d"
