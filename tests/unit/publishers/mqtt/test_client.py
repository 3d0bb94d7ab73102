from __future__ import annotations

import socket
import ssl

import pytest

from mav_robot_status.publishers.mqtt.client import OTHER, lost, unreachable
from mav_robot_status.publishers.mqtt.settings import read_broker

PLAIN = read_broker({"url": "mqtt://127.0.0.1/x"})
SECURE = read_broker({"url": "mqtts://127.0.0.1/x"})


def untrusted(why: str) -> ssl.SSLCertVerificationError:
    error = ssl.SSLCertVerificationError(1, "")
    error.verify_message = why
    return error


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (socket.gaierror(-2, "Name or service not known"), "cannot resolve the name"),
        (TimeoutError("timed out"), "no answer"),
        (ConnectionRefusedError(111, "Connection refused"), "Connection refused"),
        (ValueError("x"), "ValueError: x"),
        (
            untrusted("self-signed certificate"),
            "its certificate is not trusted: self-signed certificate; --mqtt-ca FILE names a CA to trust",
        ),
        (untrusted("certificate has expired"), "its certificate is not trusted: certificate has expired"),
    ],
)
def test_an_unreachable_broker_has_a_reason(error: Exception, reason: str) -> None:
    assert unreachable(error) == reason


def test_a_connection_closed_without_an_answer_suggests_tls_or_a_certificate() -> None:
    assert "does it need TLS" in lost(PLAIN, opened=False, steady=False)
    assert "--mqtt-cert" in lost(SECURE, opened=False, steady=False)


def test_a_connection_closed_soon_suggests_a_second_gateway_for_the_robot() -> None:
    assert OTHER in lost(PLAIN, opened=True, steady=False)
    assert lost(PLAIN, opened=True, steady=True) == "connection lost"
