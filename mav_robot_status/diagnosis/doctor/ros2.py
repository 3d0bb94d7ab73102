"""Who receives our ROS 2 topics: looks at the network, and names the next action. The table is `CASES`."""

from __future__ import annotations

import json
from typing import Final, NamedTuple

from ...publishers.ros.messages import DIAGNOSTIC_ARRAY, HARDWARE_STATUS, ROBOT_STATUS, kind_of
from ...publishers.ros.publisher import extra_of
from ...publishers.ros.settings import DDS, ZENOH, Ros2Settings
from ...publishers.ros.transport import Endpoint, UnreachableError
from .diagnosis import Case, Diagnosis, first_case

TYPES: Final = {kind.dds_name: kind for kind in (ROBOT_STATUS, DIAGNOSTIC_ARRAY, HARDWARE_STATUS)}
MOST_SHOWN: Final = 8
"""Subscriptions in the text. The JSON has all."""


class Ros2Findings(NamedTuple):
    """What was found."""

    settings: Ros2Settings
    trouble: str | None = None
    """Why the network cannot be reached."""
    subscriptions: tuple[Endpoint, ...] = ()
    """The subscriptions in every domain that have one of our types, or a topic with our name."""

    @property
    def here(self) -> tuple[Endpoint, ...]:
        """The subscriptions in our domain."""
        return tuple(one for one in self.subscriptions if one.domain == self.settings.domain)

    @property
    def foreign(self) -> tuple[Endpoint, ...]:
        """The subscriptions in our domain that have another definition of the message."""
        return tuple(one for one in self.here if not _is_ours(one))

    @property
    def unmatched(self) -> tuple[Endpoint, ...]:
        """The subscriptions in our domain that DDS does not match with our topics."""
        return tuple(one for one in self.here if one.matched is False)


def _echo(f: Ros2Findings) -> str:
    rmw = "RMW_IMPLEMENTATION=rmw_zenoh_cpp " if f.settings.middleware == ZENOH else ""
    domain = f"ROS_DOMAIN_ID={f.settings.domain} " if f.settings.domain else ""
    return f"{domain}{rmw}ros2 topic echo {f.settings.namespace}/{f.settings.topic}"


CASES: Final = (
    Case("ros2-unreachable", "the Zenoh router, or the DDS domain, cannot be reached",
         lambda f: f.trouble,
         lambda f: f.trouble or "",
         lambda f: "start the router there (ros2 run rmw_zenoh_cpp rmw_zenohd), or write its address"
         if f.settings.middleware == ZENOH else "check CYCLONEDDS_URI and the network interface",
         spoils=True),
    Case("ros2-other-domain", "there are subscribers, but in another ROS domain",
         lambda f: f.subscriptions and not f.here,
         lambda f: f"nobody subscribes in domain {f.settings.domain}, but somebody does in domain "
         f"{f.subscriptions[0].domain}",
         lambda f: f"write zenoh://{f.settings.host}:{f.settings.port}/{f.subscriptions[0].domain}",
         spoils=True),
    Case("ros2-no-subscriber", "nobody subscribes yet; the topics are available",
         lambda f: not f.here,
         lambda f: f"it can be reached, but nobody subscribes in domain {f.settings.domain}",
         lambda f: f"{_echo(f)}, on the computer that should show it"),
    Case("ros2-not-matched", "DDS does not match a subscriber with our topics: another type or quality of service",
         lambda f: f.unmatched,
         lambda f: f"{_matches(f)}: {_named(f.unmatched[0])}, but {f.unmatched[0].why}",
         lambda f: "let it use our type (industrial_msgs/msg/RobotStatus, diagnostic_msgs/msg/DiagnosticArray) and "
         "the default quality of service of ROS 2",
         spoils=True),
    Case("ros2-other-definition", "a subscriber has another definition of the message and receives nothing",
         lambda f: f.foreign,
         lambda f: f"{_named(f.foreign[0])} has another definition of the message",
         lambda f: "let it use industrial_msgs of the branch ros2_msgs_only of industrial_core, and "
         "ROS 2's diagnostic_msgs",
         spoils=True),
    Case("ros2-ok", "somebody subscribes",
         lambda f: True,
         lambda f: f"subscribers in domain {f.settings.domain}: {len(f.here)}",
         lambda f: "nothing: the topics are received"),
)  # fmt: skip
"""In the order of evaluation. The last one always applies."""


def examine(settings: Ros2Settings) -> Ros2Findings:
    """Look at the network. Raises UsageError if the extra is not installed."""
    with extra_of(settings):
        if settings.middleware == DDS:
            from ...publishers.ros.dds import subscriptions_of
        else:
            from ...publishers.ros.zenoh import subscriptions_of
    try:
        found = subscriptions_of(settings)
    except UnreachableError as error:
        return Ros2Findings(settings, str(error))
    ours = (one for one in found if one.dds_type in TYPES or kind_of(one.topic, settings) is not None)
    return Ros2Findings(settings, None, tuple(ours))


def diagnose(f: Ros2Findings) -> Diagnosis:
    """The first case that applies."""
    return first_case(CASES, f, able=True)


def as_text(f: Ros2Findings, diagnosis: Diagnosis) -> list[str]:
    """The diagnosis, the subscriptions and the next action, as lines."""
    more = [f"and {len(f.subscriptions) - MOST_SHOWN} more"] if len(f.subscriptions) > MOST_SHOWN else []
    return diagnosis.text(f.settings.name, [*map(_named, f.subscriptions[:MOST_SHOWN]), *more])


def as_json(url: str, f: Ros2Findings, diagnosis: Diagnosis) -> str:
    """The same as a JSON object."""
    return json.dumps(
        {
            "ros2": url,
            **diagnosis.members(map(_named, f.subscriptions)),
            "domain": f.settings.domain,
            "subscriptions": [one._asdict() for one in f.subscriptions],
        }
    )


def _matches(f: Ros2Findings) -> str:
    heard = len(f.here) - len(f.unmatched)
    some = "1 subscriber" if len(f.here) == 1 else f"{len(f.here)} subscribers"
    return f"{some} in domain {f.settings.domain}, {heard or 'none'} {'match' if heard > 1 else 'matches'}"


def _is_ours(one: Endpoint) -> bool:
    kind = TYPES.get(one.dds_type)
    return kind is not None and one.type_hash in ("", kind.hash)


def _named(one: Endpoint) -> str:
    return f"{one.node or 'a program'} subscribes to {one.topic} in domain {one.domain}"
