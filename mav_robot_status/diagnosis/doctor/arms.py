"""Listens to an arm with the gateway. If no status arrives, asks its controller again, to see what it answers."""

from __future__ import annotations

import dataclasses
import socket
import time
from collections.abc import Callable
from typing import Final, Protocol

from ...clock import Instant
from ...clock import now as present
from ...config import Config, HardwareConfig
from ...errors import LinkError, ProtocolError
from ...gateway.event_loop import EventLoop
from ...hardware.simple_message.interface import SimpleMessageHardwareOptions
from ...hardware.ur.interface import RATE, UrOptions
from ...hardware.ur.rtde import Session
from ...hardware.ur.status import NAMES
from ...interface import IndustrialRobotStatusHandle, LinkState
from ...simple_message import StatusReader
from ...streams import NO_OUTPUT
from ..explain import silent
from .arm_diagnosis import ArmFindings, diagnose_arm
from .collector import HEAD
from .diagnosis import Diagnosis
from .probes import PATIENCE, tcp_trouble

SETTLE: Final = 1.5
"""Seconds from the first status until motion and the operational mode are known too."""
ANSWER: Final = 3.0
"""Seconds for the controller to answer when it is asked again."""
CHUNK: Final = 4096


class Talk(Protocol):
    """What the probe says and hears."""

    def ask(self) -> bytes:
        """What to send next."""

    def hear(self, data: bytes) -> bool:
        """Whether the status is complete. Raises ProtocolError."""

    @property
    def waits_for(self) -> str:
        """What did not arrive yet."""


class RtdeTalk:
    """Asks for the values of an arm."""

    def __init__(self) -> None:
        self._session = Session(NAMES, RATE, with_firmware=False)

    def ask(self) -> bytes:
        """The next frames of the session."""
        sent, self._session.sent = self._session.sent, b""
        return sent

    def hear(self, data: bytes) -> bool:
        """Whether values arrived."""
        return bool(self._session.feed(data))

    @property
    def waits_for(self) -> str:
        """The step of the session."""
        return self._session.step.value


class StatusTalk:
    """Listens for a STATUS of simple_message."""

    waits_for = "a status"

    def __init__(self, byte_order: str) -> None:
        self._reader = StatusReader(byte_order)

    def ask(self) -> bytes:
        """Nothing: the controller speaks first."""
        return b""

    def hear(self, data: bytes) -> bool:
        """Whether a status arrived."""
        return bool(self._reader.feed(data))


def examine_arm(
    config: Config, interface: HardwareConfig, seconds: float, clock: Callable[[], Instant] = present
) -> tuple[ArmFindings, Diagnosis]:
    """Listen to one hardware interface. Raises ConfigError and UsageError for wrong options."""
    config = dataclasses.replace(
        silent(config), links=(), outs=(), vehicles=(), interfaces=(interface,), groups={}, record=None, forward=False
    )
    base, talk = _known(interface)
    try:
        found = _listen(config, base, seconds, clock)
    except LinkError as error:
        found = dataclasses.replace(base, trouble=str(error))
    if found.status is None and talk is not None:
        found = ask_again(found, talk)
    return found, diagnose_arm(found)


def _known(interface: HardwareConfig) -> tuple[ArmFindings, Talk | None]:
    """What the options say, and how to talk to the controller; None for a type of another package."""
    base = ArmFindings(interface.type, interface.name)
    if interface.type == "ur":
        ur = UrOptions.read("ur", interface.options)
        return dataclasses.replace(base, host=ur.host, port=int(ur.port)), RtdeTalk()
    if interface.type == "simple_message":
        options = SimpleMessageHardwareOptions.read("simple_message", interface.options)
        return dataclasses.replace(base, host=options.host, port=int(options.port)), StatusTalk(options.byte_order)
    return base, None


def _listen(config: Config, base: ArmFindings, seconds: float, clock: Callable[[], Instant]) -> ArmFindings:
    """Run the gateway until a status has arrived and settled, or until the time is up."""
    gateway = EventLoop(config, NO_OUTPUT, clock)
    start = clock().mono
    heard: list[float] = []

    def enough() -> bool:
        now = clock().mono
        if not heard and any(map(_is_connected, gateway.pipeline.hw.handles)):
            heard.append(now)
        return now - start >= seconds or bool(heard and now - heard[0] >= SETTLE)

    gateway.run(until=enough)
    found = dataclasses.replace(base, seconds=round(clock().mono - start, 1))
    for handle in filter(_is_connected, gateway.pipeline.hw.handles):
        names = (
            tuple(dict.fromkeys(one.name for one in reasons))
            for reasons in (handle.detail.errors, handle.detail.inhibits)
        )
        errors, inhibits = names
        return dataclasses.replace(found, status=handle.status, errors=errors, inhibits=inhibits)
    return found


def _is_connected(handle: IndustrialRobotStatusHandle) -> bool:
    return handle.detail.link is LinkState.CONNECTED


def ask_again(found: ArmFindings, talk: Talk, answer: float = ANSWER) -> ArmFindings:
    """The findings with what the controller answers within `answer` seconds."""
    trouble = tcp_trouble(found.host, found.port)
    if trouble:
        return dataclasses.replace(found, trouble=trouble)
    head, size, fault = b"", 0, ""
    end = time.monotonic() + answer
    try:
        with socket.create_connection((found.host, found.port), PATIENCE) as controller:
            controller.sendall(talk.ask())
            while (left := end - time.monotonic()) > 0:
                controller.settimeout(left)
                data = controller.recv(CHUNK)
                head, size = (head + data)[:HEAD], size + len(data)
                if not data or talk.hear(data):
                    break
                controller.sendall(talk.ask())
    except ProtocolError as error:
        fault = str(error)
    except OSError:  # it is silent, or has closed the connection: the bytes that arrived say more
        pass
    return dataclasses.replace(found, size=size, head=head, fault=fault, waits_for=talk.waits_for)
