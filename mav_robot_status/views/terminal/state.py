"""What the screen shows, as values: the vehicles, what the person has chosen, and the last lines of the log."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from .text import UNICODE, Glyphs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...clock import Instant

PaneName = Literal["detail", "explain", "transitions", "all transitions", "help"]


class Ui(NamedTuple):
    """What the person has chosen."""

    handle: str = ""
    """Of the chosen vehicle; if there is none such, the first one is chosen."""
    pane: PaneName = "detail"
    scroll: int = 0
    """The first line of the pane that is seen."""


class Change(Protocol):
    """One member of a vehicle's status became another value."""

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
        """The value that it had; None for unknown, too."""


class Vehicle(NamedTuple):
    """One row."""

    line: Mapping[str, Any]
    """Its status: the members of a native JSON line."""
    age: float | None
    """Seconds since the last heartbeat; None: never heard."""
    rates: Mapping[str, float] = {}
    """Hz of the messages that its status is made of, by name."""

    @property
    def handle(self) -> str:
        """The handle's name."""
        return str(self.line["handle"])

    @property
    def name(self) -> str:
        """`1.1`; the handle while the ids are not known."""
        system, component = self.line["system"], self.line["component"]
        return self.handle if system is None else f"{system}" if component is None else f"{system}.{component}"

    @property
    def link(self) -> str:
        """The state of its link."""
        return str(self.line["link"]["state"])

    @property
    def needs_a_look(self) -> bool:
        """Whether something is wrong with it: an error, an emergency stop, no link."""
        return bool(self.line["in_error"] or self.line["e_stopped"] or self.link != "CONNECTED")


class Logged(NamedTuple):
    """A line of the log."""

    unix_us: int
    text: str
    serious: bool = False
    """A warning or worse."""


class State(NamedTuple):
    """Everything that the screen shows."""

    connection: str
    """Where MAVLink comes from, as the person wrote it."""
    now: Instant
    vehicles: tuple[Vehicle, ...] = ()
    ui: Ui = Ui()
    explanation: Mapping[str, Any] | None = None
    """Of the chosen vehicle, while the pane shows it; None: not there yet, or never heard."""
    changes: tuple[tuple[str, Change], ...] = ()
    """Each with the name of its vehicle, the latest first, while the pane shows them."""
    log: tuple[Logged, ...] = ()
    advice: str = ""
    """What to do if no vehicle is heard."""
    glyphs: Glyphs = UNICODE

    @property
    def place(self) -> int:
        """The place of the chosen vehicle; 0 if there is none."""
        return next((i for i, vehicle in enumerate(self.vehicles) if vehicle.handle == self.ui.handle), 0)

    @property
    def chosen(self) -> Vehicle | None:
        """The chosen vehicle."""
        return self.vehicles[self.place] if self.vehicles else None


def seconds_since(stamp: str, now: Instant) -> float:
    """Seconds from an RFC 3339 stamp of our own clock until now."""
    return now.unix_us / 1e6 - datetime.fromisoformat(stamp.replace("Z", "+00:00")).timestamp()


def duration(seconds: float) -> str:
    """`12s`, `3m`, `5h`, `2d`: at most four characters for whatever is less than 27 years."""
    whole = max(0, int(seconds))
    for unit, size, most in (("s", 1, 100), ("m", 60, 100), ("h", 3600, 48)):
        if whole < size * most:
            return f"{whole // size}{unit}"
    return f"{whole // 86400}d"
