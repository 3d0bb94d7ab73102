"""Who subscribes over DDS, and whether our writers match: the middleware decides that, not the names.

A subscriber that does not match hears nothing and says nothing: its type or its quality of service differs from ours.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.qos import Policy

from .transport import Endpoint

if TYPE_CHECKING:
    from collections.abc import Mapping
    from uuid import UUID

PREFIX: Final = "rt"
"""What ROS 2 puts before the name of a topic."""
MOST_ENDPOINTS: Final = 1000
_HASH: Final = re.compile(rb"typehash=([^;]*);")
POLICIES: Final = {
    2: "durability",
    4: "deadline",
    5: "latency budget",
    6: "ownership",
    8: "liveliness",
    11: "reliability",
    12: "destination order",
    24: "type consistency",
    25: "data representation",
}
"""The numbers of the policies that DDS compares."""


class Subscriptions:
    """The subscriptions of ROS that other participants announce."""

    def __init__(self, participant: Any, domain: int) -> None:
        self._domain = domain
        self._reader = BuiltinDataReader(participant, BuiltinTopicDcpsSubscription)
        self._alive = ReadCondition(self._reader, ViewState.Any | SampleState.Any | InstanceState.Alive)

    def now(self) -> dict[UUID, Endpoint]:
        """Those that are announced now, each with its own key."""
        samples = self._reader.read(MOST_ENDPOINTS, condition=self._alive)
        found = {sample.key: self._endpoint(sample) for sample in samples}
        return {key: one for key, one in found.items() if one is not None}

    def _endpoint(self, sample: Any) -> Endpoint | None:
        """A subscription of ROS; None for one of something else."""
        name = sample.topic_name or ""
        if not name.startswith(f"{PREFIX}/"):
            return None
        data = next((bytes(policy.data) for policy in sample.qos if isinstance(policy, Policy.Userdata)), b"")
        found = _HASH.search(data)
        type_hash = found[1].decode("ascii", "replace") if found else ""
        return Endpoint(self._domain, "", name[len(PREFIX) :], sample.type_name or "", type_hash)


def judged(found: Mapping[UUID, Endpoint], topic: str, writer: Any, dds_name: str) -> dict[UUID, Endpoint]:
    """The subscriptions of a topic, each with whether this writer matches it, and why not."""
    matched = {writer.get_matched_subscription_data(handle).key for handle in writer.get_matched_subscriptions()}
    return {
        key: one._replace(matched=key in matched, why="" if key in matched else _why(one, writer, dds_name))
        for key, one in found.items()
        if one.topic == topic
    }


def _why(one: Endpoint, writer: Any, dds_name: str) -> str:
    if one.dds_type != dds_name:
        return f"its type is {one.dds_type}, ours is {dds_name}"
    policy = writer.get_offered_incompatible_qos_status().last_policy_id
    if policy:
        return f"it wants another {POLICIES.get(policy, f'policy (number {policy})')}"
    return "its definition of the message differs"
