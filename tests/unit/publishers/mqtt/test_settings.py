from __future__ import annotations

import ssl
from pathlib import Path

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.publishers.mqtt.settings import PASSWORD, default_spool, read, read_broker


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
        ("", "is not a broker"),
        ("broker/robots", "is not a broker"),
        ("mqtt://broker:99999/robots", "is not a broker"),
        ("mqtt://broker/robots?x=1", "is not a broker"),
        ("mqtt://broker", "has no prefix"),
        ("mqtt://broker/a/+/b", "has no prefix"),
        ("mqtt://broker/$SYS", "has no prefix"),
        ("mqtt://user:swordfish@broker/robots", "a URL with a user or password is visible to others"),
        ("mqtt://user:swordfish@broker:x/robots", "a URL with a user or password is visible to others"),
    ],
)
def test_the_error_for_a_wrong_url_does_not_show_its_password(url: str, says: str) -> None:
    with pytest.raises(UsageError, match=says) as raised:
        read_broker({"url": url}, {})
    assert "swordfish" not in str(raised.value)


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
    with pytest.raises(UsageError, match="chmod 600") as raised:
        read_broker({"url": "mqtt://b/r", "user": "rover", "password_file": str(file)}, {})
    assert "swordfish" not in str(raised.value)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"colour": "red"}, "unknown option 'colour'"),
        ({"robot": "x"}, "unknown option 'robot'"),
        ({"version": "4"}, "version: must be one of 5, 3.1.1"),
        ({"ca": "x.pem"}, "write mqtts://"),
        ({"keepalive": 0}, "keepalive: must be a number from 2 to 3600"),
        ({"keepalive": "soon"}, "keepalive: must be a number"),
        ({"password_file": "/nowhere"}, "/nowhere: cannot read the password"),
        ({"url": "mqtts://b/r", "key": "k.pem"}, "a key needs its certificate"),
        ({"url": "mqtts://b/r", "ca": __file__}, "cannot use .*test_settings"),
    ],
)
def test_a_wrong_option_is_an_error(more: dict[str, object], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        read_broker({"url": "mqtt://b/r", **more}, {})


def test_a_password_without_a_user_is_an_error() -> None:
    with pytest.raises(UsageError, match="needs a user"):
        read_broker({"url": "mqtt://b/r"}, {PASSWORD: "x"})


def test_the_default_spool_is_in_the_state_folder() -> None:
    broker = read_broker({"url": "mqtt://b/r"}, {})
    assert default_spool(broker, {"STATE_DIRECTORY": "/var/lib/mrs:/x"}).startswith("/var/lib/mrs/mqtt-")
    assert default_spool(broker, {"XDG_STATE_HOME": "/s"}).startswith("/s/mav-robot-status/mqtt-")
    other = read_broker({"url": "mqtt://b/other"}, {})
    assert default_spool(broker, {"XDG_STATE_HOME": "/s"}) != default_spool(other, {"XDG_STATE_HOME": "/s"})


def test_the_limits_of_the_spool_are_in_megabytes_and_days() -> None:
    options = read({"url": "mqtt://b/r", "spool": "/s/x", "spool_size": 1, "spool_age": "0.5"}, {})
    assert (options.spool, options.spool_size, options.spool_age) == ("/s/x", 1_000_000, 43_200.0)
