from __future__ import annotations

import logging
import socket
import ssl

import pytest

from mav_robot_status.publishers.mqtt.complaints import OTHER, Complaints, lost, unreachable
from mav_robot_status.publishers.mqtt.options import read_broker

PLAIN = read_broker({"url": "mqtt://127.0.0.1/x"})
SECURE = read_broker({"url": "mqtts://127.0.0.1/x"})


def unbelieved(why: str) -> ssl.SSLCertVerificationError:
    error = ssl.SSLCertVerificationError(1, "")
    error.verify_message = why
    return error


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (socket.gaierror(-2, "Name or service not known"), "the name is not known"),
        (TimeoutError("timed out"), "no answer"),
        (ConnectionRefusedError(111, "Connection refused"), "Connection refused"),
        (ValueError("x"), "ValueError: x"),
        (
            unbelieved("self-signed certificate"),
            "its certificate is not believed: self-signed certificate; --mqtt-ca FILE names the authority to believe",
        ),
        (unbelieved("certificate has expired"), "its certificate is not believed: certificate has expired"),
    ],
)
def test_why_a_broker_cannot_be_reached(error: Exception, told: str) -> None:
    assert unreachable(error) == told


def test_a_broker_that_hangs_up_at_once_may_want_tls_or_a_certificate() -> None:
    assert "does it speak TLS" in lost(PLAIN, opened=False, steady=False)
    assert "--mqtt-cert" in lost(SECURE, opened=False, steady=False)


def test_a_broker_that_hangs_up_soon_may_have_thrown_us_out_for_another() -> None:
    assert OTHER in lost(PLAIN, opened=True, steady=False)
    assert lost(PLAIN, opened=True, steady=True) == "connection lost"


def test_a_reason_is_told_once_until_a_connection_holds(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    complaints = Complaints(PLAIN)
    for _ in range(3):
        complaints.fails("no answer")
    complaints.opens()
    complaints.holds()
    complaints.fails("no answer")
    assert [record.message.rpartition(": ")[2] for record in caplog.records] == [
        "no answer; trying again", "connected again", "no answer; trying again",
    ]  # fmt: skip
