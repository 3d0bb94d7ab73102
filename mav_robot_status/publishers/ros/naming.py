"""The topic of each handle, in names that ROS 2 allows.

Source: https://design.ros2.org/articles/topic_and_service_names.html. A part of a name has letters, digits and single
underscores, and does not start with a digit. One that starts with an underscore is hidden from `ros2 topic list`.
"""

from __future__ import annotations

import logging
import re
from typing import Final

from ...interface import DEFAULT_HANDLE_NAME

log = logging.getLogger(__name__)

DIAGNOSTICS: Final = "/diagnostics"
"""The topic that every diagnostics tool reads. It is the same for all handles, and not in our namespace."""
HARDWARE_STATUS: Final = "hardware_status"
LONGEST: Final = 100  # characters of a cleaned name; DDS allows 256 for the whole topic
_OTHER: Final = re.compile(r"[^A-Za-z0-9]+")
_NAME: Final = re.compile(r"[A-Za-z](?:_?[A-Za-z0-9])*")


class Topics:
    """The topics of handles: two handles never share one.

    `robot_status` in the namespace is the topic of the default handle, `rover/robot_status` that of the handle `rover`.
    The topic does not depend on which handle comes first, unless two names differ only in what ROS does not allow.
    """

    def __init__(self, namespace: str, topic: str) -> None:
        self._namespace, self._topic = namespace, topic
        self._topics: dict[str, str] = {}
        """The topic of each handle."""

    def of(self, handle: str) -> str:
        """The topic of a handle, `/plant/rover/robot_status`. The log says it once."""
        topic = self._topics.get(handle)
        if topic is None:
            topic = self._topics[handle] = self._free(handle)
            log.info("ros2: '%s' is on the topic %s", handle, topic)
        return topic

    def forget(self, handle: str) -> str | None:
        """Free the topic of a handle that is gone, and return it."""
        return self._topics.pop(handle, None)

    def _free(self, handle: str) -> str:
        import hashlib  # the options of every gateway import this module, and few publish to ROS

        part = clean(_without_default(handle))
        taken = set(self._topics.values())
        digest = hashlib.sha256(handle.encode("utf-8", "surrogatepass")).hexdigest()
        parts = (part, *(f"{part or 'robot'}_{digest[:length]}" for length in range(6, len(digest) + 1)))
        return next(topic for topic in map(self._join, parts) if topic not in taken)

    def _join(self, part: str) -> str:
        return "/".join([self._namespace, *([part] if part else []), self._topic])


def beside(topic: str) -> str:
    """The topic of control_msgs/HardwareStatus beside that of the status: `/rover/hardware_status`."""
    return f"{topic.rpartition('/')[0]}/{HARDWARE_STATUS}"


def clean(name: str) -> str:
    """The parts of a name as ROS allows them: `Rover 2/arm` becomes `Rover_2/arm`, `2.1` becomes `robot_2_1`."""
    parts = (_OTHER.sub("_", part).strip("_") for part in name.split("/"))
    named = "/".join(f"robot_{part}" if part[0].isdigit() else part for part in parts if part)
    return named[:LONGEST].rstrip("/_") or ("robot" if name else "")


def is_name(text: str) -> bool:
    """Whether ROS allows this as a part of a name, and shows it."""
    return _NAME.fullmatch(text) is not None


def _without_default(handle: str) -> str:
    """The default name says nothing: vehicle 2.1 is `industrial_robot_status_handle/2.1`."""
    if handle == DEFAULT_HANDLE_NAME:
        return ""
    return handle.removeprefix(f"{DEFAULT_HANDLE_NAME}/")
