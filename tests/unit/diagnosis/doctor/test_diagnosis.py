from __future__ import annotations

import dataclasses
import errno
import os
from typing import Any

import pytest

from mav_robot_status.diagnosis.doctor.advice import protocol
from mav_robot_status.diagnosis.doctor.diagnosis import CASES, diagnose
from mav_robot_status.diagnosis.doctor.findings import (
    AppletReport,
    Findings,
    Place,
    Speaker,
    Trouble,
    VehicleStatus,
)
from mav_robot_status.diagnosis.doctor.rendering import as_text, remarks
from mav_robot_status.hardware.mavlink.autopilots.wanted import COMMON
from mav_robot_status.hardware.mavlink.senders import Sender, Strangers
from mav_robot_status.links.url import parse
from mav_robot_status.mavlink.counters import Counters

STATUS = VehicleStatus("HOLD", {"mode": "MANUAL", "in_error": None, "in_motion": False}, (), ("DISARMED",), COMMON)
ROVER = Speaker(1, 1, 3, 10, {0: 5, 1: 5, 33: 1}, {0: 1.0, 1: 1.0}, 11, pilot=True, status=STATUS)
GCS = Speaker(255, 190, 8, 6, {0: 5}, {0: 1.0}, 5)
SENDER = Sender("A", 1, 7.0, "first heard", "GROUND_ROVER", True, 3.2)


def speaking(**changes: Any) -> Speaker:
    """A rover with other senders."""
    return ROVER._replace(status=STATUS._replace(**changes))


TWO = speaking(strangers=Strangers("A and B", "udp:0.0.0.0:1?from=A"))
MUTE = ROVER._replace(counts={0: 5})
SERIAL, OUT, TCP = "/dev/ttyX,57600", "udpout:h:1", "tcp:h:1"


def found(connection: str = "udp:127.0.0.1:14550", **changes: Any) -> Findings:
    url = parse(connection)
    return dataclasses.replace(Findings(url, url.words(), seconds=5.0), **changes)


def heard(*speakers: Speaker, connection: str = "udp:127.0.0.1:14550", **changes: Any) -> Findings:
    frames = sum(s.frames for s in speakers)
    base = {"size": 100, "counters": Counters(frames=frames), "speakers": speakers, "good": {0: 5}}
    return found(connection, **{**base, **changes})


HERE = Place(addresses=("10.0.0.2", "192.168.1.3"))
TWO_DEVICES = Place("missing", devices=("/dev/ttyACM0", "/dev/ttyUSB0"))

# findings, cause, part of the problem text, part of the remedy text
DIAGNOSES = [
    (found(trouble=Trouble("port is taken; stop it", errno.EADDRINUSE)), "port-taken", "port is taken", "stop it"),
    (found(trouble=Trouble("no", errno.EACCES)), "no-permission", "no", "ask its owner for permission"),
    (found(trouble=Trouble("odd")), "cannot-open", "odd", "write another connection"),
    (found(SERIAL, place=Place("missing")), "device-missing", "here: none", "plug it in"),
    (found(SERIAL, place=TWO_DEVICES), "device-missing", "/dev/ttyACM0, /dev/ttyUSB0", "one of those"),
    (found(SERIAL, place=Place("missing", devices=("/dev/ttyACM0",))), "device-missing", "", "write /dev/ttyACM0"),
    (found(SERIAL, place=Place(holder="mavproxy.py (pid 7)")), "device-held", "held by mavproxy.py (pid 7)", "end"),
    (found(place=Place(elsewhere="udp:5")), "elsewhere", "but it does on udp:5", "write udp:5"),
    (
        found("udp:5?from=10.0.0.5", place=Place(elsewhere="udp:5")),
        "elsewhere",
        "",
        "add the sender to from=, or write",
    ),
    (found(place=HERE), "udp-silent", "UDP port 14550 within 5.0 s", "udp:0.0.0.0:14550"),
    (found("udp:0.0.0.0:1", place=HERE), "udp-silent", "", "send to 10.0.0.2:1 or 192.168.1.3:1"),
    (found("udp:10.0.0.2:1", place=HERE), "udp-silent", "", "send to 10.0.0.2:1, and let this computer's firewall"),
    (found("udp:[::1]:1"), "udp-silent", "", "send to [::1]:1"),
    (found("udpout:[fe80::1]:7"), "no-answer", "[fe80::1]:7 does not answer", "udp:0.0.0.0:7"),
    (found("udpbcast:10.0.0.255:7"), "no-answer", "", "firewall"),
    (found("udpbcast:10.0.0.255:7", passive=True), "must-speak", "", "remove --passive"),
    (found(OUT, place=Place("refused")), "udp-refused", "h:1 refuses", "start"),
    (found(TCP, place=Place("unreachable")), "tcp-unreachable", "unreachable", "ping h"),
    (found(TCP, passive=True), "tcp-silent", "", "MAVLink"),
    (found("tcpin:0.0.0.0:5", place=HERE), "nobody-connects", "", "connect to 10.0.0.2:5 or 192.168.1.3:5"),
    (found("tcpin:0.0.0.0:5", place=Place()), "nobody-connects", "", "connect to 0.0.0.0:5"),
    (found(SERIAL, size=9, head=b"\x80" * 9), "wrong-baud", "9 bytes arrived at 57600", "/dev/ttyX,RATE"),
    (found(size=9, head=b"\x80" * 9), "not-mavlink", "they begin with 80 80", "plain MAVLink"),
    (found(SERIAL, size=9, counters=Counters(bad_crc={0: 3})), "other-dialect", "0 HEARTBEAT (3 times)", "definitions"),
    (heard(GCS), "no-autopilot", "only 255.190 GCS", "HEARTBEAT"),
    (heard(ROVER._replace(status=None), GCS, expected=(2, 3)), "other-system", "system 2, 3 is not", "--system 1"),
    (heard(ROVER._replace(status=None), signing=True), "not-believed", "are not signed", "sign with this key"),
    (
        *(heard(ROVER._replace(status=None), signing=True, counters=Counters(frames=11, signed=11)), "not-believed"),
        *("with another key", "the vehicle's own key"),
    ),
    (heard(TWO), "two-vehicles", "two senders speak as vehicle 1.1: A and B", "yours, name it: udp:0.0.0.0:1?from=A"),
    (heard(speaking(strangers=Strangers("A and B", None))), "two-vehicles", "1.1: A and B", "MAV_SYSID"),
    (heard(speaking(senders=(SENDER,))), "late", "vehicle 1.1 is heard 7.0 s late", "a radio or a program"),
    (heard(speaking(senders=(SENDER._replace(lag=2.9),))), "ok", "a status is available", ""),
    (heard(MUTE, counters=Counters(frames=11, signed=9)), "signed", "9 of 11 frames are signed", "--signing-key"),
    (heard(ROVER._replace(counts={0: 1, 1: 1})), "few-heartbeats", "1 HEARTBEAT of 1.1", "once a second"),
    (
        *(heard(ROVER._replace(counts={0: 1}), counters=Counters(frames=10, lost=90)), "few-heartbeats"),
        *("", "repair the link first: 90 %"),
    ),
    (heard(MUTE, asked=True), "no-sys-status", "although it was requested", "SRn_EXT_STAT"),
    (heard(MUTE, passive=True), "no-sys-status", "it was not requested", "remove --passive"),
    (heard(MUTE, passive=True, connection="a.tlog"), "no-sys-status", "", "SRn_EXT_STAT"),
    (heard(MUTE._replace(autopilot=12)), "no-sys-status", "", "mavlink stream"),
    (heard(MUTE._replace(autopilot=0)), "no-sys-status", "", "let the autopilot send SYS_STATUS"),
    (heard(ROVER, MUTE._replace(system=2)), "no-sys-status", "vehicle 2.1", ""),
    (heard(ROVER._replace(frames_v1=11)), "mavlink-1", "1.1 uses MAVLink 1", "SERIALn_PROTOCOL"),
    (heard(ROVER._replace(frames_v1=11, autopilot=12)), "mavlink-1", "", "MAV_PROTO_VER"),
    (heard(ROVER._replace(clock_off=-7200.0)), "wrong-clock", "differ by 7200 s", "timedatectl"),
    (heard(ROVER._replace(clock_off=-7200.0), connection="a.tlog"), "ok", "", "mav-robot-status a.tlog"),
    (
        heard(ROVER._replace(clock_off=2.0), passive=True),
        "ok",
        "a status is available",
        "udp:127.0.0.1:14550 --passive",
    ),
    (heard(ROVER, GCS, counters=Counters(frames=16, signed=16), signing=True), "ok", "", ""),
]
BELIEVED = {"signed", "mavlink-1", "wrong-clock", "ok"}
"""Causes that still give the test vehicle a status."""


@pytest.mark.parametrize(("findings", "cause", "matter", "then"), DIAGNOSES, ids=[row[1] for row in DIAGNOSES])
def test_each_case_has_one_cause_and_one_remedy(findings: Findings, cause: str, matter: str, then: str) -> None:
    diagnosis = diagnose(findings)
    assert diagnosis.cause == cause
    assert matter in diagnosis.matter
    assert then in diagnosis.next
    assert all(text and "\n" not in text for text in (diagnosis.matter, diagnosis.next))


@pytest.mark.parametrize(("findings", "cause"), [row[:2] for row in DIAGNOSES], ids=[row[1] for row in DIAGNOSES])
def test_heartbeat_and_sys_status_are_enough_for_a_status(findings: Findings, cause: str) -> None:
    can = cause in BELIEVED and all(1 in s.counts for s in findings.vehicles)
    assert diagnose(findings).ok is can


def test_a_different_definition_of_an_unneeded_message_does_not_hide_a_healthy_link() -> None:
    bad = {230: 40, 1: 2}  # two bad SYS_STATUS of many: noise
    f = heard(ROVER, good={0: 5, 1: 5}, counters=Counters(frames=11, bad_crc=bad))
    assert diagnose(f).cause == "ok"
    assert "bad CRC: 1 SYS_STATUS (2 times), 230 (40 times)" in remarks(f)


def test_a_status_is_available_despite_a_different_message_definition() -> None:
    f = heard(ROVER, counters=Counters(frames=11, bad_crc={30: 40}))
    assert diagnose(f)[:2] == ("other-dialect", True)


def test_two_vehicles_with_the_same_id_give_no_reliable_status() -> None:
    assert not diagnose(heard(TWO)).ok


def test_the_causes_are_distinct_and_the_last_one_always_applies() -> None:
    assert len({case.cause for case in CASES}) == len(CASES)
    assert [case.cause for case in CASES if case.applies(found("a.tlog"))][-1] == "ok"


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"\x00\x17$M>\x05", "MSP"),
        (b"$X<\x00\x64", "MSP"),
        (b"1,A*7F\r\n$GNGGA,0", "NMEA"),
        (b"\xb5\x62\x01\x07\x5c\x00", "u-blox"),
        (b"$TA\x01\x02", "LTM"),
        (b"SSH-2.0-OpenSSH_9.6\r\n", "SSH"),
        (b"HTTP/1.1 400 Bad Request\r\n", "HTTP"),
        (b"\r\nU-Boot 2024.01\r\nHit any key", "a console's text"),
    ],
)
def test_other_protocols_are_recognised(head: bytes, name: str) -> None:
    known = protocol(head)
    assert known is not None
    assert known.name == name


def test_noise_and_short_text_are_not_recognised_as_a_protocol() -> None:
    assert protocol(b"hello") is None
    assert sum(protocol(os.urandom(40)) is not None for _ in range(1000)) < 5


def test_the_description_of_a_vehicle_lists_missing_messages() -> None:
    lines = list(remarks(heard(ROVER, GCS)))
    assert "vehicle 1.1: ARDUPILOTMEGA, GROUND_ROVER, flight mode HOLD" in lines
    assert "rates: HEARTBEAT 1 Hz, SYS_STATUS 1 Hz, GLOBAL_POSITION_INT once" in lines
    assert "missing: EXTENDED_SYS_STATE, ATTITUDE, SYSTEM_TIME" in lines
    assert "status: mode MANUAL, in_error UNKNOWN, in_motion FALSE" in lines
    assert "also heard: 255.190 GCS" in lines


def test_a_substitute_message_counts_as_the_message() -> None:
    assert ROVER._replace(counts={32: 9}, rates={32: 4.0}).wanted["LOCAL_POSITION_NED"] == 4.0


def test_px4_without_a_ground_station_is_reported_to_send_no_texts() -> None:
    px4 = ROVER._replace(autopilot=12)
    assert any("PX4 sends texts only" in line for line in remarks(heard(px4)))
    assert not any("PX4 sends texts only" in line for line in remarks(heard(px4, GCS)))


def test_the_text_lists_only_a_few_of_many_addresses() -> None:
    f = heard(ROVER, sources=tuple(f"10.0.0.{i}:5" for i in range(9)))
    assert "from 10.0.0.0:5, 10.0.0.1:5, 10.0.0.2:5, 10.0.0.3:5, ...;" in "\n".join(as_text(f, diagnose(f)))


def ardupilot(e_stopped: bool | None, applet: AppletReport | None) -> Speaker:
    fields = {**STATUS.fields, "e_stopped": e_stopped}
    return ROVER._replace(status=STATUS._replace(fields=fields, can_run_applet=True), applet=applet)


@pytest.mark.parametrize(
    ("vehicle", "remark", "advised"),
    [
        (ardupilot(None, None), "applet: not heard; without it an ArduPilot may show an emergency stop", True),
        (ardupilot(False, None), "applet: not heard", False),
        (ardupilot(False, AppletReport(0, 0.4)), "applet: RS_STOP 0, no stop", False),
        (ardupilot(True, AppletReport(3, 3.0)), "applet: RS_STOP 3, the emergency stop is engaged, the safety", False),
        (ardupilot(None, AppletReport(1, 0.4)), "applet: RS_STOP 1, the emergency stop is engaged", False),
        (ardupilot(None, AppletReport(2, 7.2)), "applet: RS_STOP 2, the safety switch is on; silent for 7 s", True),
    ],
)
def test_the_applet_is_advised_where_it_would_make_e_stopped_known(
    vehicle: Speaker, remark: str, advised: bool
) -> None:
    f = heard(vehicle)
    assert any(line.startswith(remark) for line in remarks(f))
    assert (diagnose(f).cause, diagnose(f).ok) == ("ok", True)
    assert ("docs/ardupilot-applet.md" in diagnose(f).next) is advised
    assert diagnose(f).next.startswith("mav-robot-status udp:127.0.0.1:14550")


def test_the_applet_is_not_mentioned_for_an_autopilot_that_cannot_run_it() -> None:
    unknown = ROVER._replace(status=STATUS._replace(fields={**STATUS.fields, "e_stopped": None}))
    assert "applet" not in "\n".join(as_text(heard(unknown), diagnose(heard(unknown))))
