"""The `demo` command: a fake rover and the real gateway in one process, over UDP loopback.

The story's notes go to the log (standard error), the statuses as JSON lines to standard output, as they change.
"""

from __future__ import annotations

import dataclasses
import logging
from typing import TYPE_CHECKING, Final

from .config import Config, LinkConfig, PublisherConfig
from .gateway.live import Live
from .gateway.plant import DEFAULT_CONTROLLER
from .link.udp import UdpLink
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
    """Play the scenario once, or for ever; SIGINT and SIGTERM end it. `speed` is that of the story's steps."""
    # port 0: the kernel picks a free one, so that the demo runs beside whatever else does
    config = Config(links=(LinkConfig("udpin:127.0.0.1:0"),), controllers=controllers)
    gateway = Live(config, stdout)
    gateway.stop_on_signals()
    link = gateway.stations[0].link
    assert isinstance(link, UdpLink)
    with FakeAutopilot(scenario, to=("127.0.0.1", link.port), loop=loop, speed=speed, on_note=_tell) as autopilot:
        gateway.run(until=lambda: autopilot.finished)


def _tell(step: Step) -> None:
    log.info("%5.1f s  %s", step.at, step.note)
