"""The name of a robot on its topics: a template with values of the vehicle and of this computer."""

from __future__ import annotations

import re
import socket
import string
from typing import Final

from ...errors import UsageError
from ...interface import LinkState, RobotStatusMsg
from ...interface.options import short

PLACES: Final = ("system", "component", "handle", "host", "serial")
SERIALS: Final = ("/sys/firmware/devicetree/base/serial-number", "/etc/machine-id")
"""Files with a serial number: the device tree (Raspberry Pi, Jetson), else the machine id of the installation."""
LONGEST: Final = 100  # characters of a name
_NO_LEVEL: Final = re.compile(r"[/+#$\s\x00-\x1f\x7f]+")


class Naming:
    """A template like `agv-{serial}-{system}`. Raises UsageError for an invalid one."""

    def __init__(self, template: str, host: str | None = None, serials: tuple[str, ...] = SERIALS) -> None:
        self._used = places(template)
        self._template = template
        self._known = {"host": host if host is not None else socket.gethostname().partition(".")[0]}
        if "serial" in self._used:
            self._known["serial"] = _serial(serials)

    def name(self, msg: RobotStatusMsg) -> str | None:
        """The robot's name, one level of a topic; None while a value of the template is unknown."""
        system, component = _ids(msg)
        of_robot = {"system": system, "component": component, "handle": msg.handle}
        if any(value is None and place in self._used for place, value in of_robot.items()):
            return None
        return level(self._template.format_map({**of_robot, **self._known}))


def _ids(msg: RobotStatusMsg) -> tuple[int | str | None, int | str | None]:
    """System and component id in a name.

    The handle stands for both where they do not name the robot: a group has the system id of its vehicle, and a robot
    without MAVLink has none.
    """
    detail = msg.detail
    if detail.members or (detail.system is None and detail.link is not LinkState.NEVER_SEEN):
        return msg.handle, msg.handle
    return detail.system, detail.component


def places(template: str) -> frozenset[str]:
    """The placeholders of a template. Raises UsageError for an invalid one.

    A placeholder is a name alone. A format of Python can name a width of gigabytes, or an attribute: it is refused.
    """
    used = set()
    try:
        for _, name, form, conversion in string.Formatter().parse(template):
            if name is not None:
                used.add(name if name in PLACES and not (form or conversion) else "?")
    except ValueError:
        used.add("?")
    if "?" in used:
        known = ", ".join(f"{{{place}}}" for place in PLACES)
        raise UsageError(f"mqtt: robot {short(template)} is not a valid template; the placeholders are {known}")
    if not level(template.format_map(dict.fromkeys(PLACES, "x"))):
        raise UsageError(f"mqtt: robot {short(template)} gives an empty name")
    return frozenset(used)


def level(text: str) -> str:
    """A text as one level of a topic."""
    return _NO_LEVEL.sub("-", text)[:LONGEST]


def _serial(paths: tuple[str, ...]) -> str:
    for path in paths:
        try:
            with open(path, encoding="ascii", errors="replace") as file:
                text = file.read(200).strip("\0\n ")
        except OSError:
            continue
        if text:
            return text
    raise UsageError("mqtt: this computer has no serial number; write the robot's name without {serial}")
