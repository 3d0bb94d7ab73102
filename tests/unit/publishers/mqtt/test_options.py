from __future__ import annotations

import ssl
from pathlib import Path

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.publishers.mqtt.options import PASSWORD, default_spool, read, read_broker


def test_a_url_names_the_broker_and_the_prefix() -> None:
    broker = read_broker({"url": "mqtt://broker.example/plant/robots/"}, {})
    assert (broker.host, broker.port, broker.prefix, broker.tls) == ("broker.example", 1883, "plant/robots", None)
    assert (broker.version, broker.keepalive, broker.user) == ("5", 10, None)


def test_mqtts_verifies_the_brokers_certificate() -> None:
    broker = read_broker({"url": "mqtts://[::1]:9000/robots"}, {})
    assert (broker.host, broker.port) == ("::1", 9000)
    assert broker.tls is not None
    assert (broker.tls.verify_mode, broker.tls.check_hostname) == (ssl.CERT_REQUIRED, True)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("", "is no broker"),
        ("broker/robots", "is no broker"),
        ("mqtt://broker:99999/robots", "is no broker"),
        ("mqtt://broker/robots?x=1", "is no broker"),
        ("mqtt://broker", "no prefix"),
        ("mqtt://broker/a/+/b", "no prefix"),
        ("mqtt://broker/$SYS", "no prefix"),
        ("mqtt://user:swordfish@broker/robots", "no user or password in the URL"),
        ("mqtt://user:swordfish@broker:x/robots", "no user or password in the URL"),
    ],
)
def test_what_is_no_url_is_said_without_its_password(url: str, says: str) -> None:
    with pytest.raises(UsageError, match=says) as told:
        read_broker({"url": url}, {})
    assert "swordfish" not in str(told.value)


def test_a_password_comes_from_a_file_or_the_environment(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("correct horse\n")
    file.chmod(0o600)
    options: dict[str, object] = {"url": "mqtt://b/r", "user": "rover"}
    assert read_broker({**options, "password_file": str(file)}, {}).password == "correct horse"
    assert read_broker(options, {PASSWORD: "battery"}).password == "battery"
    assert read_broker(options, {}).password is None


def test_a_password_file_that_others_may_read_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("swordfish")
    file.chmod(0o640)
    with pytest.raises(UsageError, match="chmod 600") as told:
        read_broker({"url": "mqtt://b/r", "user": "rover", "password_file": str(file)}, {})
    assert "swordfish" not in str(told.value)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"colour": "red"}, "unknown option 'colour'"),
        ({"robot": "x"}, "unknown option 'robot'"),
        ({"version": "4"}, "is none of 5, 3.1.1"),
        ({"ca": "x.pem"}, "write mqtts://"),
        ({"keepalive": 0}, "is no number from 2 to 3600"),
        ({"keepalive": "soon"}, "is no number"),
        ({"password_file": "/nowhere"}, "/nowhere: cannot read the password"),
        ({"url": "mqtts://b/r", "key": "k.pem"}, "a key needs its certificate"),
        ({"url": "mqtts://b/r", "ca": __file__}, "cannot use .*test_options"),
    ],
)
def test_what_is_no_option_is_one_line(more: dict[str, object], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        read_broker({"url": "mqtt://b/r", **more}, {})


def test_a_password_without_a_user_is_a_mistake() -> None:
    with pytest.raises(UsageError, match="needs a user"):
        read_broker({"url": "mqtt://b/r"}, {PASSWORD: "x"})


def test_events_wait_where_the_system_keeps_state() -> None:
    broker = read_broker({"url": "mqtt://b/r"}, {})
    assert default_spool(broker, {"STATE_DIRECTORY": "/var/lib/mrs:/x"}).startswith("/var/lib/mrs/mqtt-")
    assert default_spool(broker, {"XDG_STATE_HOME": "/s"}).startswith("/s/mav-robot-status/mqtt-")
    other = read_broker({"url": "mqtt://b/other"}, {})
    assert default_spool(broker, {"XDG_STATE_HOME": "/s"}) != default_spool(other, {"XDG_STATE_HOME": "/s"})


def test_the_bounds_of_the_spool_are_megabytes_and_days() -> None:
    options = read({"url": "mqtt://b/r", "spool": "/s/x", "spool_size": 1, "spool_age": "0.5"}, {})
    assert (options.spool, options.spool_size, options.spool_age) == ("/s/x", 1_000_000, 43_200.0)
