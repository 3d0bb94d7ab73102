"""What a configuration holds. The annotations are the schema from which the file is read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, NamedTuple

from ..hardware.options import HardwareOptions, Within
from ..interface import DEFAULT_HANDLE_NAME


class Or(NamedTuple):
    """The word that stands for None."""

    word: str


Id = Within(1, 255)


@dataclass(frozen=True, slots=True)
class LinkConfig:
    """A link to a vehicle, or an output."""

    url: str
    """As `link.url.parse` takes it; it was checked."""
    passive: bool = False
    """Nothing is ever sent there."""
    robot_status: Annotated[bool | None, Or("auto")] = None
    """Whether ROBOT_STATUS is sent to the vehicles there; None: yes, but not on serial lines, which are narrow."""


@dataclass(frozen=True, slots=True)
class VehicleConfig:
    """A vehicle to expect, and the handle that its status goes to."""

    system: Annotated[int | None, Id, Or("auto")] = None
    """None: the first autopilot heard that no other entry names."""
    component: Annotated[int | None, Id, Or("any")] = None
    """None: any autopilot of that system."""
    handle: str = DEFAULT_HANDLE_NAME


@dataclass(frozen=True, slots=True)
class IdentityConfig:
    """Who we are on MAVLink."""

    system: Annotated[int | None, Id, Or("auto")] = None
    """None: the system of the vehicle that we speak about."""
    component: Annotated[int, Id] = 192
    heartbeat: bool = True
    """Send a HEARTBEAT of our own."""


@dataclass(frozen=True, slots=True)
class SigningConfig:
    """MAVLink 2 signing: what we send is signed, and what comes in is believed only with a signature."""

    key_file: str
    """As `gateway.keys.read_key` takes it; it was not opened."""
    accept_unsigned: Literal["none", "radio_status", "all"] = "radio_status"
    """What is taken without a signature: telemetry radios have no key to sign their RADIO_STATUS with."""
    link_id: Annotated[int, Within(0, 255)] = 192
    """Of our first link; each further link and out has the next. Only senders with our system and component ids must
    use others."""


@dataclass(frozen=True, slots=True)
class PublisherConfig:
    """An output of a controller, by the name under which it is registered."""

    type: str
    options: Mapping[str, object] = field(default_factory=dict)
    where: str = field(default="", compare=False)
    """`file:line:column`; empty if no file names it."""


@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """A controller to load: a top-level mapping with a type, as in ros_control."""

    name: str
    type: str
    parameters: Mapping[str, object]
    """Everything beside the type, as plain values; only what is written, without defaults."""
    where: str
    """`file:line:column` of the stanza."""
    publishers: tuple[PublisherConfig, ...] | None = None
    """The parameter `publishers`, read; None if it is not written."""


@dataclass(frozen=True, slots=True)
class Config:
    """A whole configuration; as created, the defaults."""

    links: tuple[LinkConfig, ...] = ()
    outs: tuple[LinkConfig, ...] = ()
    """Where MAVLink goes besides the vehicles' links."""
    vehicles: tuple[VehicleConfig, ...] = ()
    """Empty: every autopilot heard becomes a handle."""
    identity: IdentityConfig = IdentityConfig()
    hardware: HardwareOptions = field(default_factory=HardwareOptions)
    requests: Literal["missing", "none"] = "missing"
    """Whether a message that is needed and does not come is asked for."""
    signing: Annotated[SigningConfig | None, Or("none")] = None
    """None: nothing is signed or verified."""
    coalesce: Annotated[float, Within(0.0, 1.0, "s")] = 0.0
    """Seconds to let input gather before it is read: fewer wake-ups for as much delay."""
    forward: bool = False
    """Pass every frame on between the links and the outs, by MAVLink's routing rules."""
    record: Annotated[str | None, Or("none")] = None
    """The .tlog file that takes everything received and sent."""
    controllers: tuple[ControllerConfig, ...] = ()
    """Empty: the default controller."""
