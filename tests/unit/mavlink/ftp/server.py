"""A download played against the file server of the fake PX4 on a manual clock, over a link that may be bad."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from mav_robot_status.mavlink.ftp.payload import Payload, unpack
from mav_robot_status.testing.file_server import FileServer
from mav_robot_status.testing.lossy import Lossy, LossyLink

TICK = 0.02


class Machine(Protocol):
    @property
    def ended(self) -> bool: ...

    def due(self, now: float) -> Payload | None: ...

    def heard(self, answer: Payload, now: float) -> None: ...


def play(
    machine: Machine,
    server: FileServer,
    lossy: Lossy | None = None,
    *,
    until: float = 400.0,
    see: Callable[[float, Payload], None] = lambda now, payload: None,
) -> float:
    """Play until the machine has ended, and return when. `see` gets every request and every answer that arrives."""
    there: LossyLink[bytes] = LossyLink(lossy or Lossy())
    back: LossyLink[bytes] = LossyLink((lossy or Lossy())._replace(seed=7))
    for tick in range(round(until / TICK)):
        now = tick * TICK
        requests = []
        while (request := machine.due(now)) is not None:
            see(now, request)
            requests.append(request.pack())
        arrived = there.carry(requests)
        answers = [answer for one in arrived for answer in server.answer(one, now)]
        for field in back.carry(answers):
            answer = unpack(field)
            assert answer is not None
            see(now, answer)
            machine.heard(answer, now)
        if machine.ended:
            return now
    raise AssertionError(f"not ended after {until} s")
