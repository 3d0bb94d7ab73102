import importlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.errors import UsageError
from mav_robot_status.links import LinkKind, open_link
from mav_robot_status.links.kinds import LOG, SERIAL
from mav_robot_status.links.url import KINDS, help_text, parse

NETWORK = [
    ("udp:127.0.0.1:14550", "udpin", "127.0.0.1", 14550),
    ("udpin:0.0.0.0:14550", "udpin", "0.0.0.0", 14550),
    ("udpin::14550", "udpin", "0.0.0.0", 14550),
    ("udpin:127.0.0.1:0", "udpin", "127.0.0.1", 0),
    ("udpin://127.0.0.1:14550", "udpin", "127.0.0.1", 14550),
    ("udp://:14540", "udpin", "0.0.0.0", 14540),
    ("udp://127.0.0.1:14540/", "udpin", "127.0.0.1", 14540),
    ("UDP:127.0.0.1:14550", "udpin", "127.0.0.1", 14550),
    ("udp:[::1]:14550", "udpin", "::1", 14550),
    ("udpin://[::]:14550", "udpin", "::", 14550),
    ("udpout:192.168.1.20:14550", "udpout", "192.168.1.20", 14550),
    ("udpout://rover.local:14550", "udpout", "rover.local", 14550),
    ("udpout:[fe80::1%eth0]:14550", "udpout", "fe80::1%eth0", 14550),
    ("192.168.1.20:14550", "udpout", "192.168.1.20", 14550),
    ("rover:14550", "udpout", "rover", 14550),
    ("[::1]:14550", "udpout", "::1", 14550),
    ("udpbcast:192.168.1.255:14550", "udpbcast", "192.168.1.255", 14550),
    ("tcp:127.0.0.1:5760", "tcp", "127.0.0.1", 5760),
    ("tcpout://127.0.0.1:5760", "tcp", "127.0.0.1", 5760),
    ("tcp:[::1]:5760", "tcp", "::1", 5760),
    ("tcpin:0.0.0.0:5760", "tcpin", "0.0.0.0", 5760),
    ("tcpin://:5760", "tcpin", "0.0.0.0", 5760),
    ("tcpin:127.0.0.1:0", "tcpin", "127.0.0.1", 0),
    (":14550", "udpin", "0.0.0.0", 14550),
    ("udp:14550", "udpin", "0.0.0.0", 14550),
    ("udpin:14550", "udpin", "0.0.0.0", 14550),
    ("tcpin:5760", "tcpin", "0.0.0.0", 5760),
    # BlueOS, mavlink-server
    ("udpserver:0.0.0.0:14550", "udpin", "0.0.0.0", 14550),
    ("udpserver://0.0.0.0:14550", "udpin", "0.0.0.0", 14550),
    ("udpserver:14550", "udpin", "0.0.0.0", 14550),
    ("udpclient:192.168.2.1:14550", "udpout", "192.168.2.1", 14550),
    ("udpclient://192.168.2.1:14550", "udpout", "192.168.2.1", 14550),
    ("tcpserver:0.0.0.0:5760", "tcpin", "0.0.0.0", 5760),
    ("tcpserver://[::]:5760", "tcpin", "::", 5760),
    ("tcpclient:127.0.0.1:5760", "tcp", "127.0.0.1", 5760),
    ("tcpclient://rover.local:5760", "tcp", "rover.local", 5760),
    # hosts that look a little like a scheme
    ("server:14550", "udpout", "server", 14550),
    ("tcp1:5760", "udpout", "tcp1", 5760),
    ("mqtt:14550", "udpout", "mqtt", 14550),
]


@pytest.mark.parametrize(("text", "kind", "host", "port"), NETWORK)
def test_a_network_form_is_understood(text: str, kind: str, host: str, port: int) -> None:
    url = parse(text)
    assert (url.kind.name, url.host, url.port, url.device, url.baud, url.text) == (kind, host, port, "", 0, text)


@pytest.mark.parametrize(
    ("text", "host", "senders"),
    [
        ("udp:0.0.0.0:14550?from=10.0.0.5", "0.0.0.0", ("10.0.0.5",)),
        ("udpin://0.0.0.0:14550/?from=10.0.0.5,10.0.0.0/24", "0.0.0.0", ("10.0.0.5", "10.0.0.0/24")),
        ("udp:14550?from=10.0.0.5/32,10.0.0.5", "0.0.0.0", ("10.0.0.5",)),
        (":14550?from=10.0.0.5", "0.0.0.0", ("10.0.0.5",)),
        ("udp:[::]:14550?from=10.0.0.5,FE80::1,fe80::/10", "::", ("10.0.0.5", "fe80::1", "fe80::/10")),
        ("udp:[::]:14550?from=::ffff:10.0.0.5", "::", ("10.0.0.5",)),
        ("udp:rover.local:14550?from=10.0.0.5", "rover.local", ("10.0.0.5",)),
        ("tcpin:14550?from=10.0.0.5", "0.0.0.0", ("10.0.0.5",)),
    ],
)
def test_the_addresses_that_are_heard_stand_behind_the_port(text: str, host: str, senders: tuple[str, ...]) -> None:
    url = parse(text)
    assert (url.host, url.port, url.senders, url.text) == (host, 14550, senders, text)
    assert url.words().endswith(f", from {', '.join(senders)} only")
    assert parse(url.text) == url


@pytest.mark.parametrize(
    ("text", "device", "baud"),
    [
        ("/dev/ttyACM0", "/dev/ttyACM0", 57600),
        ("/dev/ttyACM0,115200", "/dev/ttyACM0", 115200),
        ("/dev/ttyAMA0:921600", "/dev/ttyAMA0", 921600),
        ("serial:///dev/ttyUSB0:57600", "/dev/ttyUSB0", 57600),
        ("serial:///dev/ttyUSB0", "/dev/ttyUSB0", 57600),
        ("serial:/dev/ttyUSB0,9600", "/dev/ttyUSB0", 9600),
        ("serial:/dev/ttyUSB0:115200", "/dev/ttyUSB0", 115200),
        ("serial:///dev/ttyACM0?baudrate=115200", "/dev/ttyACM0", 115200),
        ("/dev/ttyUSB0:115200:8N1", "/dev/ttyUSB0", 115200),
        ("/dev/ttyUSB0,115200,8n1", "/dev/ttyUSB0", 115200),
        ("/dev/ttyUSB0:8N1", "/dev/ttyUSB0", 57600),
        ("/dev/serial/by-id/usb-Holybro_0-if00", "/dev/serial/by-id/usb-Holybro_0-if00", 57600),
        ("/dev/serial/by-path/pci-0:00:14.0-usb-0:1:1.0", "/dev/serial/by-path/pci-0:00:14.0-usb-0:1:1.0", 57600),
        ("/dev/serial/by-path/pci-0:00:14.0-usb-0:1", "/dev/serial/by-path/pci-0:00:14.0-usb-0:1", 57600),
        ("/dev/serial/by-path/pci-0:00:14.0-usb-0:1.0:115200", "/dev/serial/by-path/pci-0:00:14.0-usb-0:1.0", 115200),
    ],
)  # fmt: skip
def test_a_serial_form_is_understood(text: str, device: str, baud: int) -> None:
    url = parse(text)
    assert (url.kind.name, url.device, url.baud, url.text) == ("serial", device, baud, text)


def test_the_baud_option_applies_to_devices_without_a_rate() -> None:
    assert parse("/dev/ttyACM0", baud=115200).baud == 115200
    assert parse("/dev/ttyACM0,9600", baud=115200).baud == 9600


def test_a_link_to_a_terminal_outside_dev_is_serial(tmp_path: Path) -> None:
    terminal = tmp_path / "ttyV0"
    terminal.symlink_to("/dev/null")
    assert parse(f"{terminal},9600")[:5] == (SERIAL, "", 0, str(terminal), 9600)
    assert parse(f"{terminal}:9600:8N1")[:5] == (SERIAL, "", 0, str(terminal), 9600)


def test_a_file_that_exists_or_a_name_in_tlog_is_a_log(tmp_path: Path) -> None:
    recording = tmp_path / "flight.tlog.1"
    recording.touch()
    assert parse(str(recording)).kind.is_log
    assert parse("no such/flight.TLOG")[:4] == (LOG, "", 0, "no such/flight.TLOG")


def test_the_text_of_a_connection_describes_the_link() -> None:
    assert parse("udp:127.0.0.1:14550").words() == "listening on 127.0.0.1:14550/udp"
    assert parse("192.168.1.20:14550").words() == "sending to 192.168.1.20:14550/udp"
    assert parse("tcp:[::1]:5760").words() == "connecting to [::1]:5760/tcp"
    assert parse("/dev/ttyACM0").words() == "serial /dev/ttyACM0 at 57600 baud"
    assert parse("flight.tlog").words() == "recorded log flight.tlog"


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("udp:127.0.0.1", "has no port; write for example udp:127.0.0.1:14550"),
        ("udp:10.1.1.1:", "has no port; write for example udp:10.1.1.1:14550"),
        ("udpout:14550", "is not HOST:PORT; write for example udpout:192.168.1.20:14550"),
        (":65536", "a port is 1 to 65535, not 65536"),
        ("14550", "is a port; write udp:14550 to listen there, or HOST:14550 to send"),
        ("upd:14550", "unknown connection type upd:; did you mean udp: ? For a host write udpout:upd:14550"),
        ("updin:14550", "did you mean udpin: ?"),
        ("udpni:127.0.0.1:14550", "did you mean udpin: ?"),
        ("udp_in:127.0.0.1:14550", "did you mean udpin: ?"),
        ("udpin127.0.0.1:14550", "a colon is missing; write udpin:127.0.0.1:14550"),
        ("udpclient://192.168.2.1:14550?direction=sender", "write udpout:192.168.2.1:14550"),
        ("/dev/ttyUSB0:115200:7E1", "the frame format is 8N1, as MAVLink has it, not 7E1; write /dev/ttyUSB0:115200"),
        ("/dev/ttyUSB0,57600,8E2", "the frame format is 8N1, as MAVLink has it, not 8E2; write /dev/ttyUSB0:57600"),
        ("tcp-l://0.0.0.0:5760", "is MAVROS's form; write tcpin:0.0.0.0:5760"),
        ("tcp-l://", "is MAVROS's form; write tcpin:0.0.0.0:5760"),
        ("udp-b://@", "is MAVROS's form; write udpbcast:192.168.1.255:14550"),
        ("serial-hwfc:///dev/ttyUSB0:57600", "flow control is not used; write serial:/dev/ttyUSB0:57600"),
        ("mqtt://broker/robots", "is an MQTT broker, which is an output; write --mqtt mqtt://broker/robots"),
        ("http://10.1.1.1:8080", "is a web address, not a source of MAVLink; to serve a web page write --http 127."),
        ("https://example.com/flight.tlog", "is a web address"),
        ("zenoh://localhost:7447", "is an output for ROS 2; write --ros2 zenoh://localhost:7447"),
        ("ur:10.0.0.1", "is an arm, not a source of MAVLink; write --arm ur:10.0.0.1"),
        ("file:///tmp/flight.tlog", "is a file; write its path alone: /tmp/flight.tlog"),
        ("udp:14550?from=rover", "'rover' is not an address or a network, such as 10.0.0.5 or 10.0.0.0/24 (no host"),
        ("udp:14550?from=10.0.0.5/24", "'10.0.0.5/24' is not an address or a network"),
        ("udp:14550?from=10.0.0.5/24", "; write 10.0.0.5 or 10.0.0.0/24"),
        ("udp:14550?from=10.0.0.5:14550", "; write 10.0.0.5"),
        ("udp:[::]:14550?from=[fe80::1]", "; write fe80::1"),
        ("udp:14550?from=10.0.0.256", "'10.0.0.256' is not an address"),
        ("udp:14550?from=10.0.0.5&from=10.0.0.6", "is not an address or a network"),
        ("udp:14550?from=10.0.0.5,", "from= names nobody; write an address or a network"),
        ("udp:14550?from", "from= names nobody"),
        ("udp:14550?form=10.0.0.5", "did you mean udp:14550?from=10.0.0.5 ?"),
        ("udp:14550?from=fe80::1", "fe80::1 is IPv6, and 0.0.0.0 hears only IPv4; listen on [::]"),
        ("udp:[::1]:14550?from=10.0.0.5", "10.0.0.5 is IPv4, and ::1 hears only IPv6; listen on [::]"),
        ("udpout:10.0.0.5:14550?from=10.0.0.5", "from= is for links on which anybody can speak, udp: and tcpin:"),
        ("10.0.0.5:14550?from=10.0.0.5", "tcpin:; write udpout:10.0.0.5:14550"),
        ("udpbcast:10.0.0.255:14550?from=10.0.0.5", "tcpin:; write udpbcast:10.0.0.255:14550"),
        ("tcp:10.0.0.5:5760?from=10.0.0.5", "tcpin:; write tcp:10.0.0.5:5760"),
        ("/dev/ttyUSB0,57600?from=10.0.0.5", "tcpin:; write /dev/ttyUSB0,57600"),
        ("serial:/dev/ttyUSB0?from=10.0.0.5", "tcpin:; write serial:/dev/ttyUSB0"),
        ("flight.tlog?from=10.0.0.5", "tcpin:; write flight.tlog"),
        ("udp:", "has no port; write for example udp:127.0.0.1:14550"),
        ("tcp:[::1]", "has no port; write for example tcp:[::1]:5760"),
        ("192.168.1.20", "has no port; write 192.168.1.20:14550 to send there, or udp:192.168.1.20:14550 to listen"),
        ("udp:127.0.0.1:65536", "a port is 1 to 65535, not 65536"),
        ("udp:127.0.0.1:" + "9" * 5000, "a port is 1 to 65535, not 999999999999;"),
        ("udpout:127.0.0.1:0", "a port is 1 to 65535, not 0"),
        ("tcp:127.0.0.1:0", "a port is 1 to 65535, not 0"),
        ("udpout::14550", "has no host; write for example udpout:192.168.1.20:14550"),
        ("udp:::1:14550", "write an IPv6 address in brackets, udp:[::1]:14550"),
        ("upd:127.0.0.1:14550", "unknown connection type upd:; did you mean udp: ?"),
        ("tpc://127.0.0.1:5760", "did you mean tcp: ?"),
        ("udp://:14540@127.0.0.1:14557", "write udp:0.0.0.0:14540 to listen, or udpout:127.0.0.1:14557 to send"),
        ("udp://@", "write udp:0.0.0.0:14550 to listen"),
        ("/dev/ttyACM0,fast", "the baud rate must be a number; write for example /dev/ttyACM0,57600"),
        ("/dev/ttyACM0,0", "the baud rate must be a number"),
        ("serial:", "names no device; write for example /dev/ttyACM0,57600"),
        ("logs/flight", "no such file; write the path of a recorded .tlog"),
        ("/", "is a folder; write the path of a recorded .tlog"),
        ("flight", "is neither a connection nor a file that exists; write for example udp:127.0.0.1:14550, /dev/"),
        ("", "is neither a connection nor a file that exists"),
    ],
)  # fmt: skip
def test_an_error_is_one_line_with_the_fault_and_a_correction(text: str, part: str) -> None:
    with pytest.raises(UsageError) as raised:
        parse(text)
    assert part in str(raised.value)
    assert repr(text) in str(raised.value)


PIECES = st.sampled_from(
    [s for kind in KINDS for s in kind.schemes]
    + [":", "//", "[", "]", "@", "/dev/", "/", ",", ".", "%", "::1", "127.0.0.1", "14550", "9" * 5000]
    + ["\n", "\0", "²", "\udc80"]
)  # fmt: skip


@given(st.one_of(st.text(), st.lists(st.one_of(PIECES, st.text(max_size=3)), max_size=8).map("".join)))
def test_any_text_is_valid_or_a_one_line_error(text: str) -> None:
    try:
        url = parse(text)
    except UsageError as error:
        lines = str(error).splitlines()
    else:
        assert url.text == text
        assert url.device or 0 <= url.port <= 65535
        assert url.words()
        lines = ["understood"]
    assert len(lines) == 1


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_each_example_is_of_its_kind_and_in_the_help(kind: LinkKind) -> None:
    assert parse(kind.example).kind == kind
    assert kind.example in help_text()
    assert kind.forms in help_text()


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_each_kind_names_an_importable_opener(kind: LinkKind) -> None:
    if isinstance(kind.opener, str):
        module, _, name = kind.opener.partition(":")
        assert callable(getattr(importlib.import_module(module), name))
    else:
        assert callable(kind.opener)


def test_a_log_cannot_be_opened_as_a_live_link() -> None:
    with pytest.raises(UsageError, match=r"'flight\.tlog' is a recorded log, which can only be read"):
        open_link(parse("flight.tlog"))
