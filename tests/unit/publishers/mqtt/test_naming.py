from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.interface import Detail, LinkState, RobotStatus, RobotStatusMsg
from mav_robot_status.publishers.mqtt.naming import Naming


def msg(system: int | None = 7, handle: str = "rover", **detail: Any) -> RobotStatusMsg:
    return RobotStatusMsg(handle, 0, RobotStatus(), Detail(system, None if system is None else 1, **detail), None)


def test_a_template_is_filled_in_with_known_values(tmp_path: Path) -> None:
    serial = tmp_path / "serial"
    serial.write_text("1000abcd\0")
    naming = Naming("{host}.{serial}.{system}.{component}.{handle}", "pi", ("/nowhere", str(serial)))
    assert naming.name(msg()) == "pi.1000abcd.7.1.rover"


def test_a_name_may_be_the_bare_serial_number() -> None:
    assert Naming("AGV-0042").name(msg(None)) == "AGV-0042"


def test_a_robot_has_no_name_while_a_value_of_the_template_is_unknown() -> None:
    assert Naming("{host}-{system}", "pi").name(msg(None, link=LinkState.NEVER_SEEN)) is None


@pytest.mark.parametrize("template", ["{host}-{system}", "{host}-{component}", "{host}-{handle}"])
def test_a_robot_without_mavlink_has_the_name_of_its_handle(template: str) -> None:
    for link in (LinkState.CONNECTED, LinkState.LOST):
        assert Naming(template, "pi").name(msg(None, "arm", link=link)) == "pi-arm"


@pytest.mark.parametrize("link", LinkState)
@pytest.mark.parametrize("system", [7, None])
def test_a_group_has_another_name_than_its_vehicle_and_keeps_it(system: int | None, link: LinkState) -> None:
    naming = Naming("{host}-{system}", "pi")
    assert naming.name(msg()) == "pi-7"
    assert naming.name(msg(system, "robot", link=link, members=("rover", "arm"))) == "pi-robot"


def test_a_name_is_one_level_of_a_topic() -> None:
    assert Naming("a/b+{handle}").name(msg(handle="x y/#\0z")) == "a-b-x-y-z"
    assert len(Naming("{handle}").name(msg(handle="x" * 500)) or "") == 100


@pytest.mark.parametrize(
    "template",
    [
        "{color}",
        "{system.real}",
        "{0}",
        "{",
        "{system!q}",
        "{system!r}",
        "{handle:>2000000000}",
        "{handle:{system}}",
        "{handle.__class__}",
        "{handle[0]}",
        "{}",
        "",
    ],
)
def test_an_invalid_template_is_an_error(template: str) -> None:
    with pytest.raises(UsageError, match="robot"):
        Naming(template)


def test_a_missing_serial_number_is_an_error() -> None:
    with pytest.raises(UsageError, match=r"without \{serial\}"):
        Naming("{serial}", serials=("/nowhere",))
