from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from mav_robot_status.config import SigningConfig
from mav_robot_status.gateway.links.signing_policy import HEALING_PERIOD, SigningPolicy
from mav_robot_status.mavlink.definitions import CRC_EXTRA, Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser
from mav_robot_status.mavlink.signing import Signer, Verdict, stamp_at
from mav_robot_status.testing import ManualClock

KEY = bytes.fromhex("ab" * 32)


NOW = ManualClock().now()
STAMP = stamp_at(NOW.unix_us)

Start = Callable[..., SigningPolicy]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Start:
    """Starts a policy; each has the files of the one before."""
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    key = tmp_path / "key"
    key.write_text(KEY.hex())
    key.chmod(0o600)
    return lambda accept="radio_status": SigningPolicy(SigningConfig(str(key), accept), NOW)


@pytest.fixture
def policy(start: Start) -> SigningPolicy:
    return start()


def heartbeat(stamp: int | None = None, link_id: int = 0) -> Frame:
    """A vehicle's heartbeat, signed with this stamp, or unsigned."""
    data = encode(Heartbeat(0, 2, 3, 81, 4, 3), system=1, component=1, sequence=0)
    (frame,) = Parser(CRC_EXTRA).feed(data if stamp is None else Signer(KEY, link_id, stamp - 1).sign(data, 0))
    return frame


def test_a_flood_of_stale_heartbeats_gets_one_answer_per_period(policy: SigningPolicy) -> None:
    answered = [tick / 100 for tick in range(500) if policy.may_heal(Verdict.STALE, tick / 100)]
    assert answered == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert HEALING_PERIOD == 1.0


@pytest.mark.parametrize("verdict", [verdict for verdict in Verdict if verdict is not Verdict.STALE])
def test_only_stale_heartbeats_are_answered(policy: SigningPolicy, verdict: Verdict) -> None:
    assert not policy.may_heal(verdict, 5.0)
    assert policy.may_heal(Verdict.STALE, 5.0)


def killed(policy: SigningPolicy) -> None:
    assert policy._heard._file.settle()


@pytest.mark.parametrize("stop", [SigningPolicy.close, killed])
def test_what_was_heard_before_a_restart_is_no_news_after_it(start: Start, stop: Callable[..., None]) -> None:
    first = start()
    recorded = [heartbeat(STAMP + number) for number in range(3)]
    assert {first.judge(frame, NOW) for frame in recorded} == {Verdict.VERIFIED}
    first.keep(NOW.mono)
    stop(first)
    again = start()
    assert {again.judge(frame, NOW) for frame in recorded} == {Verdict.STALE}
    assert again.judge(heartbeat(STAMP + 3), NOW) is Verdict.VERIFIED


def test_a_frame_is_late_by_the_newest_stamp_of_any_link(policy: SigningPolicy) -> None:
    for frame, lag in ((heartbeat(STAMP + 500_000, link_id=1), 0.0), (heartbeat(STAMP), 5.0)):
        assert policy.judge(frame, NOW) is Verdict.VERIFIED
        assert policy.lag(frame) == lag


def test_what_a_radio_may_send_unsigned_speaks_for_no_vehicle(policy: SigningPolicy) -> None:
    unsigned = Frame(109, (1, 1), 0, None, b"")
    assert policy.judge(unsigned, NOW) is Verdict.LET_THROUGH
    assert not policy.may_speak(unsigned)
    assert policy.may_speak(heartbeat(STAMP))


def test_with_all_accepted_an_unsigned_frame_speaks_for_a_vehicle_until_that_signs(start: Start) -> None:
    policy = start("all")
    assert policy.may_speak(heartbeat())
    policy.judge(heartbeat(STAMP), NOW)
    assert policy.judge(heartbeat(), NOW) is Verdict.LET_THROUGH
    assert not policy.may_speak(heartbeat())
