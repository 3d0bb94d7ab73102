"""Conformance tests for publishers: the behaviour of `mav_robot_status.interface.Publisher` that the gateway relies on.

Subclass `PublisherConformance` in a test module of your package::

    class TestLamp(PublisherConformance):
        options = {"file": "lamp.txt"}

        def make_publisher(self, context: PublisherContext) -> Publisher:
            return LampPublisher(context)

pytest then runs the tests on your publisher.
"""

from __future__ import annotations

import dataclasses
import math
import os
import threading
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import Final, NamedTuple, TextIO

import pytest

from ...clock import Instant, later
from ...errors import UsageError
from ...interface import (
    Audience,
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    Options,
    Publisher,
    PublisherContext,
    RobotMode,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    Vehicle,
)

LIMIT: Final = 20.0
"""Seconds for all calls of a test. A publisher that takes longer blocks."""
FLAGS: Final = ("live_only", "durable", "one_handle")
START: Final = Instant(1000.0, 1_800_000_000_000_000)
HOSTILE: Final = '"\\\n\x00\x1b[2J</script>\ud800é'
"""A text of an autopilot with hostile characters."""

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
MOVING: Final = RobotStatus(
    mode=RobotMode.AUTO, e_stopped=FALSE, drives_powered=TRUE, motion_possible=TRUE, in_motion=TRUE, in_error=FALSE
)
FAILING: Final = MOVING._replace(in_error=TRUE, error_code=2**31 - 1)
STOPPED: Final = RobotStatus(
    mode=RobotMode.MANUAL, e_stopped=TRUE, drives_powered=FALSE, motion_possible=FALSE, in_motion=FALSE, in_error=FALSE
)
REASONS: Final = (Inhibit("E_STOPPED", HOSTILE, 0), Inhibit("OF_ANOTHER_ROBOT", None, 2**62))
CASES: Final[tuple[tuple[RobotStatus, Detail], ...]] = (
    (RobotStatus(), Detail()),
    (RobotStatus(), Detail(link=LinkState.NEVER_SEEN)),
    (RobotStatus(), Detail(1, 1, (), (Inhibit("LINK_STALE", None, 1),), Vehicle("PX4"), LinkState.LOST)),
    (MOVING, Detail(1, 1, vehicle=Vehicle("PX4", "GROUND_ROVER", HOSTILE, 2**32 - 1, "ACTIVE"))),
    (STOPPED, Detail(255, 255, (), REASONS)),
    (FAILING, Detail(1, 1, (ErrorCause(2**31 - 1, "A_CAUSE", HOSTILE, 0), ErrorCause(-1, "B", None, 0)))),
    (FAILING, Detail()),
)
"""Every kind of status that a hardware interface may give."""


class RecordedPort:
    """A MAVLink port with one ground station. It stores the sent messages."""

    def __init__(self) -> None:
        self.sent: list[tuple[NamedTuple, int]] = []

    def audiences(self) -> Sequence[Audience]:
        """One ground station."""
        return (Audience("ground station", mirror=True),)

    def requests(self) -> Collection[tuple[Hashable, int]]:
        """No requests."""
        return ()

    def send(self, message: NamedTuple, system: int, audience: Audience) -> None:
        """Store the message."""
        self.sent.append((message, system))


class PublisherConformance:
    """The tests. A subclass provides the publisher and its options."""

    options: Mapping[str, object] = {}

    def make_publisher(self, context: PublisherContext) -> Publisher:
        """A new publisher."""
        raise NotImplementedError(f"{type(self).__name__} needs a method `make_publisher`")

    def setup_method(self) -> None:
        """Standard output is a pipe that is never read."""
        read, write = os.pipe()
        self._reader = read
        self._stdout: TextIO = os.fdopen(write, "w")
        self._made: list[Publisher] = []

    def teardown_method(self) -> None:
        """Close the publishers of the test."""
        for publisher in self._made:
            publisher.close()
        os.close(self._reader)
        self._stdout.close()

    def context(self, **more: object) -> PublisherContext:
        """The context of a live gateway; `more` are further options."""
        return PublisherContext({**self.options, **more}, RecordedPort(), self._stdout)

    def make(self) -> Publisher:
        """A new publisher."""
        made = self.make_publisher(self.context())
        self._made.append(made)
        return made

    def test_its_flags_are_bools(self) -> None:
        """`periodic`, and the others where the class sets them."""
        made = self.make()
        for flag in ("periodic", *FLAGS):
            value = getattr(made, flag, False)
            assert isinstance(value, bool), f"{flag} must be a bool, not {value!r}"
        assert hasattr(made, "periodic"), "a publisher must have the attribute 'periodic'"

    def test_the_class_has_the_same_flags_as_the_object(self) -> None:
        """The gateway reads them before it makes a publisher."""
        made = self.make()
        for flag in FLAGS:
            assert getattr(type(made), flag, False) == getattr(made, flag, False), flag

    def test_an_unknown_option_is_an_error_if_the_options_are_declared(self) -> None:
        """A misspelt option in a configuration must not go unnoticed."""
        declared = getattr(type(self.make()), "options_type", None)
        if declared is None:
            return
        assert issubclass(declared, Options)
        assert dataclasses.is_dataclass(declared)
        with pytest.raises(UsageError, match="no_such_option"):
            self.make_publisher(self.context(no_such_option=1))

    def test_it_publishes_every_status(self) -> None:
        """Known and unknown values, robots without ids, texts with control characters."""
        within(lambda: self._feed(self.make(), CASES * 3))

    def test_no_call_blocks_without_a_reader(self) -> None:
        """Standard output is full, and no broker or browser answers: every call still returns."""
        within(lambda: self._feed(self.make(), CASES * 300))

    def test_busy_is_a_bool_and_changes_nothing(self) -> None:
        """The controller calls it at every update, even if no message is due."""
        made = self.make()
        answers = [made.busy() for _ in range(100)]
        assert all(isinstance(answer, bool) for answer in answers)
        assert len(set(answers)) == 1, "busy() must not change while nothing is published"

    def test_service_without_a_message_returns_none_or_a_time(self) -> None:
        """The gateway calls it at every turn, even before the first message."""
        made = self.make()
        for turn in range(100):
            self._service(made, later(START, turn / 10))

    def test_it_can_be_closed_at_once(self) -> None:
        """After an error elsewhere in the configuration, the gateway closes publishers that never published."""
        within(self.make().close)

    def test_it_can_be_closed_twice(self) -> None:
        """The second call does nothing."""
        made = self.make()
        within(made.close)
        within(made.close)

    def test_it_can_be_closed_while_messages_wait(self) -> None:
        """`close` does not wait for a reader that has disconnected."""
        made = self.make()
        within(lambda: self._feed(made, CASES * 300, service=False))
        within(made.close)

    def _feed(self, publisher: Publisher, cases: Sequence[tuple[RobotStatus, Detail]], service: bool = True) -> None:
        """Call `busy`, `publish` and `service` as the gateway does."""
        for number, (status, detail) in enumerate(cases):
            now = later(START, number / 10)
            age = None if detail.link is LinkState.NEVER_SEEN else 0.1
            if not publisher.busy():
                publisher.publish(RobotStatusMsg(f"robot {number % 3}", now.unix_us, status, detail, age))
            if service:
                self._service(publisher, now)

    def _service(self, publisher: Publisher, now: Instant) -> None:
        again = publisher.service(now)
        assert again is None or (isinstance(again, int | float) and not math.isnan(again)), (
            f"service() must return None or monotonic seconds, not {again!r}"
        )


def within(call: Callable[[], object], limit: float = LIMIT) -> None:
    """Call it in another thread. Raises its exception, or AssertionError if it does not return in time."""
    raised: list[BaseException] = []

    def run() -> None:
        try:
            call()
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(limit)
    if raised:
        raise raised[0]
    assert not thread.is_alive(), f"a publisher must not block; this call took more than {limit:g} s"
