"""The `demo` command: a fake rover and the real gateway in one process, over UDP loopback.

The notes of the scenario go to the log (standard error), each change of a status to standard output as a JSON line.
"""

from __future__ import annotations

import dataclasses
import logging
from typing import TYPE_CHECKING, Final

from .config import Config, LinkConfig, PublisherConfig
from .gateway.controller_config import DEFAULT_CONTROLLER
from .gateway.event_loop import EventLoop
from .links.udp import UdpLink
from .testing import DEMO, FakeAutopilot

if TYPE_CHECKING:
    from typing import TextIO

    from .config import ControllerConfig
    from .testing import Scenario, Step

log = logging.getLogger(__name__)


DEMO_CONTROLLER: Final = dataclasses.replace(
    DEFAULT_CONTROLLER, publishers=(PublisherConfig("json", {"changes_only": True}), PublisherConfig("mavlink"))
)


def run_demo(
    stdout: TextIO,
    *,
    loop: bool = False,
    scenario: Scenario = DEMO,
    speed: float = 1.0,
    controllers: tuple[ControllerConfig, ...] = (DEMO_CONTROLLER,),
) -> None:
    """Play the scenario once, or in a loop until SIGINT or SIGTERM. `speed` is the speed of its steps."""
    # port 0: the kernel picks a free port
    config = Config(links=(LinkConfig("udpin:127.0.0.1:0"),), controllers=controllers)
    gateway = EventLoop(config, stdout)
    gateway.stop_on_signals()
    link = gateway.endpoints[0].link
    assert isinstance(link, UdpLink)
    with FakeAutopilot(scenario, to=("127.0.0.1", link.port), loop=loop, speed=speed, on_note=_log_note) as autopilot:
        gateway.run(until=lambda: autopilot.finished)


def _log_note(step: Step) -> None:
    log.info("%5.1f s  %s", step.at, step.note)
