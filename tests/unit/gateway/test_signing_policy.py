from __future__ import annotations

from pathlib import Path

import pytest

from mav_robot_status.config import SigningConfig
from mav_robot_status.gateway.signing_policy import HEALING_PERIOD, SigningPolicy
from mav_robot_status.mavlink.signing import Verdict
from mav_robot_status.testing import ManualClock


@pytest.fixture
def policy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SigningPolicy:
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    key = tmp_path / "key"
    key.write_text("ab" * 32)
    key.chmod(0o600)
    return SigningPolicy(SigningConfig(str(key)), ManualClock().now())


def test_a_flood_of_stale_heartbeats_gets_one_answer_per_period(policy: SigningPolicy) -> None:
    answered = [tick / 100 for tick in range(500) if policy.may_heal(Verdict.STALE, tick / 100)]
    assert answered == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert HEALING_PERIOD == 1.0


@pytest.mark.parametrize("verdict", [verdict for verdict in Verdict if verdict is not Verdict.STALE])
def test_only_stale_heartbeats_are_answered(policy: SigningPolicy, verdict: Verdict) -> None:
    assert not policy.may_heal(verdict, 5.0)
    assert policy.may_heal(Verdict.STALE, 5.0)
