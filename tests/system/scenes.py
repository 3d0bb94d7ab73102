"""Robots in every state, as JSON lines, on a page without a gateway: for the tests of the page, and its pictures."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from types import TracebackType
from typing import Any, Final

from mav_robot_status.clock import Instant, rfc3339
from mav_robot_status.clock import now as present
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.web.events import Events
from mav_robot_status.publishers.web.serve import serve
from mav_robot_status.publishers.web.settings import WebSettings

from ..deadline import SOON, allow, wait_until

Line = dict[str, Any]
UNKNOWN: Final = dict.fromkeys(("e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error"))
AGO: Final = 40.0
"""Seconds since which a cause lasts."""


def line(handle: str, system: int = 1, **members: Any) -> Line:
    """A parked rover: disarmed and healthy."""
    stamp = rfc3339(present().unix_us)
    return {
        "stamp": stamp,
        "seq": 0,
        "handle": handle,
        "system": system,
        "component": 1,
        "mode": "MANUAL",
        "e_stopped": False,
        "drives_powered": False,
        "motion_possible": False,
        "in_motion": False,
        "in_error": False,
        "error_code": 0,
        "errors": [],
        "inhibits": [inhibit("DISARMED")],
        "vehicle": vehicle("HOLD"),
        "link": {"state": "CONNECTED", "heartbeat_age": 0.4},
    } | members


def vehicle(flight_mode: str | None, **members: Any) -> Line:
    """The member `vehicle` of a rover."""
    return {
        "autopilot": "ARDUPILOTMEGA",
        "type": "GROUND_ROVER",
        "flight_mode": flight_mode,
        "custom_mode": None if flight_mode is None else 4,
        "state": None if flight_mode is None else "STANDBY",
    } | members


def inhibit(name: str, text: str | None = None, **members: Any) -> Line:
    """A reason why motion is not possible."""
    return {"name": name, "text": text, "since": rfc3339(present().unix_us - int(AGO * 1e6)), **members}


def error(code: int, name: str, text: str | None) -> Line:
    """An active error."""
    return {"code": code, **inhibit(name, text)}


def parked(handle: str, system: int = 1) -> Line:
    """Disarmed and healthy."""
    return line(handle, system)


def ready(handle: str, system: int = 1) -> Line:
    """Armed, under a program, still."""
    live = {"mode": "AUTO", "drives_powered": True, "motion_possible": True, "inhibits": []}
    return line(handle, system, **live, vehicle=vehicle("AUTO"))


def moving(handle: str, system: int = 1) -> Line:
    """It drives by itself."""
    return ready(handle, system) | {"in_motion": True}


def failing(handle: str, system: int = 1) -> Line:
    """It cannot be armed."""
    return line(handle, system, inhibits=[inhibit("PREARM_FAILING", "GPS 1: Bad fix"), inhibit("DISARMED")])


def armable(handle: str, system: int = 1) -> Line:
    """Disarmed, and its checks pass."""
    return line(handle, system, vehicle=vehicle("HOLD", can_arm=True))


def crashed(handle: str, system: int = 1) -> Line:
    """It has crashed, and disarmed."""
    found = error(4001, "CRASH", "Crash: Going to HOLD")
    return parked(handle, system) | {"in_error": True, "error_code": 4001, "errors": [found]}


def doubled(handle: str, system: int = 1) -> Line:
    """Two autopilots have its system id."""
    found = error(9002, "SYSTEM_ID_CONFLICT", None)
    return ready(handle, system) | {"in_error": True, "error_code": 9002, "errors": [found]}


def faulty(handle: str, system: int = 1) -> Line:
    """Armed with an error."""
    found = error(2003, "BATTERY_LOW", "Battery 1 is low 10.61V")
    return ready(handle, system) | {"in_error": True, "error_code": 2003, "errors": [found]}


def stopped(handle: str, system: int = 1) -> Line:
    """Its emergency stop is engaged."""
    return line(
        handle, system, e_stopped=True, inhibits=[inhibit("E_STOPPED", "Motor Emergency Stop"), inhibit("DISARMED")]
    )


def in_error(handle: str, system: int = 1) -> Line:
    """It moves although it is in error."""
    found = error(2004, "BATTERY_CRITICAL", "Battery 1 is critical 10.21V used 4910 mAh")
    return moving(handle, system) | {"in_error": True, "error_code": 2004, "errors": [found]}


def unsure(handle: str, system: int = 1) -> Line:
    """Heard, but it does not tell."""
    return line(handle, system, **UNKNOWN, mode="UNKNOWN", inhibits=[inhibit("SYS_STATUS_MISSING")])


def lost(handle: str, system: int = 1, age: float = 75.0) -> Line:
    """Its link is lost."""
    return line(
        handle,
        system,
        **UNKNOWN,
        mode="UNKNOWN",
        inhibits=[inhibit("LINK_STALE")],
        vehicle=vehicle(None),
        link={"state": "LOST", "heartbeat_age": age},
    )


def unheard(handle: str, system: int = 1) -> Line:
    """Configured, and never heard."""
    return lost(handle, system) | {
        "link": {"state": "NEVER_SEEN", "heartbeat_age": None},
        "vehicle": vehicle(None, autopilot=None, type=None),
    }


def group(handle: str = "robot", system: int = 1) -> list[Line]:
    """A rover with an arm whose emergency stop is engaged."""
    base, arm = ready("base", system), stopped("arm", system) | {"component": 2, "mode": "AUTO"}
    arm["vehicle"] = vehicle(None, autopilot="UNIVERSAL_ROBOTS", type="UR5E")
    whole = ready(handle, system) | {"component": 192, "members": ["base", "arm"], "e_stopped": None}
    return [whole, base, arm]


KINDS: Final = (moving, parked, ready, failing, in_error, parked, lost, stopped, moving, unsure, parked, unheard)
"""What stands in a fleet, again and again."""
NAMES: Final = ("rover-north", "rover-south", "copter", "mower", "tug", "boat", "scout", "carrier", "picker", "spare")


def fleet(number: int) -> list[Line]:
    """So many robots, in all states; a third has a name of its own."""
    found = []
    for n in range(number):
        made = KINDS[n % len(KINDS)](f"{NAMES[n % len(NAMES)]}-{n + 1}", n % 254 + 1)
        if n % 3 == 0:
            made["vehicle"] = {**made["vehicle"], "name": f"{NAMES[n % len(NAMES)].title()} {n + 1}"}
        found.append(made)
    return found


class Page:
    """`with Page() as page:` A page whose lines are put there by hand."""

    def __init__(self, **settings: Any) -> None:
        self.server = serve(Board(), WebSettings(port=0, **settings))
        self.url = self.server.url

    def __enter__(self) -> Page:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, broken: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.server.close()

    def put(self, *lines: Mapping[str, Any], ago: float = 0.0, last: Mapping[str, Any] | None = None) -> None:
        """Put lines on the board, as of some seconds ago; return when they are there."""
        self._do(lambda board, at: [board.update_line(one["handle"], one, at - ago, last) for one in lines])

    def only(self, lines: Iterable[Mapping[str, Any]]) -> None:
        """Remove all other robots. A lost robot drove before."""

        def change(board: Board, at: float) -> None:
            for handle in list(board.entries):
                board.forget(handle)
            for one in lines:
                if one["link"]["state"] == "LOST":
                    board.update_line(one["handle"], moving(one["handle"], one["system"]), at - 75)
                board.update_line(one["handle"], one, at)

        self._do(change)

    def explain(self, handle: str, fields: Mapping[str, Any]) -> None:
        """Explain a robot that a browser shows."""
        wait_until(lambda: handle in self.server.watched)
        explanation = {"handle": handle, "fields": fields}
        wait_until(lambda: self.server.post(lambda board, events, now: events.explain(handle, explanation)))

    def _do(self, change: Any) -> None:
        done = threading.Event()

        def run(board: Board, events: Events, now: Instant) -> None:
            change(board, now.mono)
            done.set()

        wait_until(lambda: self.server.post(run))
        assert done.wait(allow(SOON))


STATES = (stopped, crashed, doubled, faulty, lost, failing, unsure, unheard, ready, moving, armable, parked)
"""Every state of one robot, as a function of its name, in the order of the table."""
