"""The values of a configuration. The annotations are the schema of the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal

from ..hardware.group import RULES, Rule
from ..hardware.mavlink.options import HardwareOptions, OneOf, Or, Within
from ..interface import DEFAULT_HANDLE_NAME

Id = Within(1, 255)
VehicleName = Annotated[str, "name of a vehicle"]
"""What people call a vehicle, see `is_vehicle_name`."""
LONGEST_NAME: Final = 40
"""Characters of the name of a vehicle."""
GroupField = Annotated[str, OneOf(tuple(RULES))]


def is_vehicle_name(text: str) -> bool:
    """Whether a text can be the name of a vehicle: printable, not blank, not too long."""
    return 0 < len(text) <= LONGEST_NAME and text.isprintable() and not text.isspace()


@dataclass(frozen=True, slots=True)
class LinkConfig:
    """A link to a vehicle, or an output."""

    url: str
    """A checked connection string, see `links.url.parse`; with the addresses of the key `from`."""
    passive: bool = False
    """Nothing is ever sent there."""
    robot_status: Annotated[bool | None, Or("auto")] = None
    """Whether ROBOT_STATUS is sent to the vehicles there. None: yes, except on serial links, which are slow."""
    speech_limit: Annotated[float | None, Within(0.0, 1e5, "B/s"), Or("auto")] = None
    """The most bytes a second that we send there without being asked. 0: no limit. None: 1000 on a link to vehicles,
    no limit on an out: the user has ordered us to send there."""

    heartbeat_timeout: Annotated[float | None, Within(0.1, 86400.0, "s"), Or("auto")] = None
    """Seconds without a heartbeat after which a vehicle there counts as lost. None: `hardware.heartbeat_timeout`; for a
    vehicle that sends only HIGH_LATENCY2, three of its longest interval, at least 60 s."""


@dataclass(frozen=True, slots=True)
class VehicleConfig:
    """An expected vehicle and its handle."""

    system: Annotated[int | None, Id, Or("auto")] = None
    """None: the first autopilot heard that no other entry names."""
    component: Annotated[int | None, Id, Or("any")] = None
    """None: any autopilot of that system."""
    handle: str = DEFAULT_HANDLE_NAME
    name: Annotated[VehicleName | None, Or("none")] = None
    """What people call it."""


@dataclass(frozen=True, slots=True)
class NameConfig:
    """The name of a vehicle that need not be expected: an entry of `vehicles` with a `name` and without a `handle`."""

    system: Annotated[int, Id]
    name: VehicleName
    component: Annotated[int | None, Id, Or("any")] = None
    """None: each autopilot of that system."""


@dataclass(frozen=True, slots=True)
class IdentityConfig:
    """Our ids on MAVLink."""

    system: Annotated[int | None, Id, Or("auto")] = None
    """None: the system id of the vehicle that a message is about."""
    component: Annotated[int, Id] = 192
    heartbeat: bool = True
    """Send our own HEARTBEAT."""


@dataclass(frozen=True, slots=True)
class SigningConfig:
    """MAVLink 2 signing: we sign what we send, and accept only signed frames."""

    key_file: str
    """The path for `gateway.signing_keys.read_key`; not opened yet."""
    accept_unsigned: Literal["none", "radio_status", "all"] = "radio_status"
    """Frames that are accepted without a signature: telemetry radios have no key to sign their RADIO_STATUS."""
    link_id: Annotated[int, Within(0, 255)] = 192
    """The link id of our first link. Each further link and out has the next one. Another sender with our
    system and component ids must use other link ids."""


@dataclass(frozen=True, slots=True)
class HardwareConfig:
    """A hardware interface other than MAVLink. `type` is its registered name."""

    type: str
    name: str
    options: Mapping[str, object] = field(default_factory=dict)
    """Everything except type and name, as plain values."""
    where: str = field(default="", compare=False)
    """`file:line:column`."""


@dataclass(frozen=True, slots=True)
class PublisherConfig:
    """A publisher of a controller. `type` is its registered name."""

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
    """Everything except the type, as plain values, without defaults."""
    where: str
    """`file:line:column` of the stanza."""
    publishers: tuple[PublisherConfig, ...] | None = None
    """The parameter `publishers`, read; None if it is not written."""


@dataclass(frozen=True, slots=True)
class GroupConfig:
    """Several handles as one. The name of the group is the name of its handle."""

    handles: tuple[str, ...] = ()
    """Its members. Empty: every handle that is not a group."""
    fields: Mapping[GroupField, Rule] = field(default_factory=dict)
    """The rules that differ from `hardware.group.RULES`."""


NO_EFFECT: Final = {
    "kernel_filter": "{} has no effect any more: every frame is read, so lost frames are always counted; remove it",
}
"""The keys of former versions that are still accepted, for one release. `{}`: the key, or the option in its place."""


@dataclass(frozen=True, slots=True)
class Config:
    """A whole configuration. As created it has the defaults."""

    links: tuple[LinkConfig, ...] = ()
    outs: tuple[LinkConfig, ...] = ()
    """Receivers of MAVLink other than the vehicle links."""
    vehicles: tuple[VehicleConfig, ...] = ()
    """Empty: every autopilot heard becomes a handle."""
    names: Mapping[tuple[int, int | None], str] = field(default_factory=dict)
    """More names of vehicles by system and component id, from entries without a `handle` and from `--name`. Component
    None: each autopilot of the system."""
    identity: IdentityConfig = IdentityConfig()
    hardware: HardwareOptions = field(default_factory=HardwareOptions)
    """The options of the MAVLink hardware interface."""
    interfaces: tuple[HardwareConfig, ...] = ()
    """The other hardware interfaces."""
    groups: Mapping[str, GroupConfig] = field(default_factory=dict)
    """The groups, by the names of their handles."""
    requests: Literal["missing", "none"] = "missing"
    """Whether a needed message that does not arrive is requested."""
    signing: Annotated[SigningConfig | None, Or("none")] = None
    """None: nothing is signed or verified."""
    coalesce: Annotated[float, Within(0.0, 1.0, "s")] = 0.0
    """Seconds to wait for more input before reading: fewer wake-ups if several frames come within it, more delay."""
    max_gap: Annotated[float, Within(0.0, 86400.0, "s")] = 60.0
    """After the link is lost, a silence of a recorded log that is longer than this gives one line."""
    forward: bool = False
    """Forward every frame between the links and the outs, by MAVLink's routing rules."""
    record: Annotated[str | None, Or("none")] = None
    """The .tlog file for all frames received and sent."""
    controllers: tuple[ControllerConfig, ...] = ()
    """Empty: the default controller."""
    without_effect: tuple[str, ...] = ()
    """A line for each key that is written and has no effect any more: where, why, and what to do."""

    @property
    def hears_mavlink(self) -> bool:
        """Whether MAVLink vehicles can appear: there are links, or no other hardware interface."""
        return bool(self.links) or not self.interfaces
