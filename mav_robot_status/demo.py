"""The `demo` command: fake robots and the real gateway in one process, over loopback.

On a terminal it shows the live table with one line of the story. Else the notes of the story go to the log (standard
error), and each change of a status to standard output as a JSON line.
"""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import socket
from collections.abc import Callable, Iterator, Sequence
from typing import Final, NamedTuple, TextIO

from .config import Config, ControllerConfig, GroupConfig, HardwareConfig, LinkConfig, PublisherConfig, VehicleConfig
from .errors import LinkError, UsageError
from .gateway.background import BackgroundGateway
from .gateway.controller_config import DEFAULT_CONTROLLER
from .gateway.event_loop import EventLoop
from .links.udp import UdpLink
from .links.url import parse
from .testing import (
    DEMO,
    Scenario,
    Step,
    arduboat,
    arducopter,
    arduplane,
    ardurover,
    ardusub,
    betaflight,
    inav,
    px4,
    px4_vtol,
    quadplane,
)
from .testing.fake_arm import FakeArm
from .testing.fake_fleet import FakeFleet
from .testing.mobile_manipulator import BASE, follow
from .testing.scenario import ending
from .testing.udp_fake import Address
from .views import terminal

log = logging.getLogger(__name__)

DEMO_CONTROLLER: Final = dataclasses.replace(
    DEFAULT_CONTROLLER, publishers=(PublisherConfig("json", {"changes_only": True}), PublisherConfig("mavlink"))
)
LINKS: Final = (LinkConfig("udpin:127.0.0.1:0"),)  # port 0: the kernel picks a free port
FLEET: Final = (
    DEMO,
    arducopter.AUTO,
    px4.KILL,
    ardurover.PREARM_FAILING,
    arduplane.AUTO,
    arducopter.LINK_SILENCE,
    ardusub.DIVE,
    px4.READY,
    ardurover.RC_ESTOP,
    px4_vtol.TRANSITION,
    arduboat.DRIFT,
    inav.DRIVE,
    ardurover.CRASH,
    quadplane.READY,
    betaflight.READY,
    ardurover.READY,
)
"""The vehicles of a fleet: of several types, some with problems. A larger fleet begins again from the first."""
QUIET: Final = {1: 1.0, 245: 1.0, 33: 1.0, 30: 1.0, 74: 1.0}
"""Hz of the streams of each vehicle in a fleet of more than FEW."""
FEW: Final = 20


class Story(NamedTuple):
    """What the demo plays, and the configuration of the gateway that watches it."""

    scenarios: Sequence[Scenario]
    config: Config
    note: Callable[[int, Step], None]
    to: tuple[Address, ...] = ()
    """Further receivers of everything that the vehicles send."""
    loop: bool = False
    speed: float = 1.0


def fleet(count: int) -> list[Scenario]:
    """The scenarios of a fleet of `count` vehicles."""
    found = [ending(FLEET[i % len(FLEET)]) for i in range(count)]
    return [one._replace(streams=QUIET) for one in found] if count > FEW else found


def receiver(url: str) -> Address:
    """Where `--out` sends: the address on which another program listens. Raises UsageError, LinkError."""
    found = parse(url)
    if "udp" not in found.kind.name or not found.host:
        raise UsageError(f"--out {url}: the demo sends on UDP; write --out udp:127.0.0.1:14550")
    try:
        return socket.getaddrinfo(found.host, found.port, socket.AF_INET, socket.SOCK_DGRAM)[0][4]  # type: ignore[return-value]
    except OSError as error:
        raise LinkError(f"--out {url}: {found.host}: {error.strerror}; write an IPv4 address") from None


def run_demo(
    stdout: TextIO,
    *,
    loop: bool = False,
    scenarios: Sequence[Scenario] = (DEMO,),
    speed: float = 1.0,
    controllers: tuple[ControllerConfig, ...] = (DEMO_CONTROLLER,),
    to: tuple[Address, ...] = (),
    live: bool = False,
) -> None:
    """Play the scenarios once, or in a loop until SIGINT or SIGTERM. `speed` is the speed of their steps.

    `live`: show the table on the terminal instead of lines on `stdout`.
    """
    note = _note if len(scenarios) == 1 else _note_of
    _play(Story(scenarios, Config(links=LINKS, controllers=controllers), note, to, loop, speed), stdout, live)


def run_mobile_manipulator(
    stdout: TextIO,
    *,
    loop: bool = False,
    controllers: tuple[ControllerConfig, ...] = (DEMO_CONTROLLER,),
    to: tuple[Address, ...] = (),
    live: bool = False,
) -> None:
    """Play the story of a rover and the arm on it, as `run_demo` does."""
    with FakeArm() as arm:
        ports = {"host": "127.0.0.1", "port": arm.port, "dashboard_port": arm.dashboard_port}
        config = Config(
            links=LINKS,
            vehicles=(VehicleConfig(handle="base"),),
            interfaces=(HardwareConfig("ur", "arm", ports),),
            groups={"robot": GroupConfig(("base", "arm"))},
            controllers=controllers,
        )
        acting = follow(arm, lambda step: _note(1, step))
        _play(Story((BASE,), config, lambda system, step: acting(step), to, loop), stdout, live)


def _play(story: Story, stdout: TextIO, live: bool) -> None:
    if live:
        _show(story)
        return
    gateway = EventLoop(story.config, stdout)
    gateway.stop_on_signals()
    with _playing(story, gateway) as vehicles:
        gateway.run(until=lambda: vehicles.finished)


def _show(story: Story) -> None:
    """The plain table. It needs no extra and no keys."""
    told: list[str] = [""]

    def note(system: int, step: Step) -> None:
        story.note(system, step)
        told[0] = _words(step) if len(story.scenarios) == 1 else _words_of(system, step)

    beside = story.config.controllers[0].publishers or ()
    with BackgroundGateway(
        story.config, beside=[one for one in beside if one.type not in ("json", "mavlink")]
    ) as source:
        source.connection = "demo"
        hint = [f"the same vehicles are on udp:{host}:{port}" for host, port in story.to]
        hint += [f"page: http://{one.options['listen']}" for one in beside if one.type == "http"]
        footer = "; ".join([*hint, "Ctrl-C: quit"])
        with _playing(story._replace(note=note), source.gateway):
            terminal.show(source, lambda: (told[0], footer))


@contextlib.contextmanager
def _playing(story: Story, gateway: EventLoop) -> Iterator[FakeFleet]:
    link = gateway.endpoints[0].link
    assert isinstance(link, UdpLink)
    to = (("127.0.0.1", link.port), *story.to)
    with FakeFleet(story.scenarios, to, loop=story.loop, speed=story.speed, on_note=story.note) as vehicles:
        yield vehicles


def _words(step: Step) -> str:
    return f"{step.at:5.1f} s  {step.note}"


def _words_of(system: int, step: Step) -> str:
    return f"vehicle {system}: {step.note}"


def _note(system: int, step: Step) -> None:
    log.info("%s", _words(step))


def _note_of(system: int, step: Step) -> None:
    log.debug("%s", _words_of(system, step))
