"""The configuration of a DDS domain, and one that Cyclone DDS refuses."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: no wheel for this Python")

from mav_robot_status.publishers.ros.dds import COMPATIBLE, DdsTransport, configuration
from mav_robot_status.publishers.ros.settings import DDS, Ros2Settings
from mav_robot_status.publishers.ros.transport import UnreachableError

DOMAIN = Ros2Settings(DDS, 151)


@pytest.mark.parametrize(
    ("settings", "parts", "peers"),
    [
        (DOMAIN, {"Compatibility"}, []),
        (DOMAIN._replace(local=True), {"Compatibility", "General", "Discovery"}, ["127.0.0.1"]),
        (DOMAIN._replace(peers=("a", '"<b>')), {"Compatibility", "Discovery"}, ["a", '"<b>']),
        (DOMAIN._replace(local=True, peers=("a",)), {"Compatibility", "General", "Discovery"}, ["127.0.0.1", "a"]),
    ],
)
def test_the_configuration_of_a_domain(
    settings: Ros2Settings, parts: set[str], peers: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "file:///etc/cyclonedds.xml")
    ours, _, given = configuration(settings).rpartition(",")
    assert given == "file:///etc/cyclonedds.xml"
    domain = ET.fromstring(ours)[0]
    assert COMPATIBLE in ours
    assert {part.tag for part in domain} == parts
    assert [peer.get("address") for peer in domain.iter("Peer")] == peers
    assert (domain.find(".//NetworkInterface[@address='127.0.0.1']") is not None) is settings.local


@pytest.mark.parametrize("given", ["<CycloneDDS><Domain><Nonsense/></Domain></CycloneDDS>", "<Größe/>"])
def test_a_wrong_configuration_is_one_line_that_names_it(given: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", given)
    with pytest.raises(UnreachableError, match=r"cannot join: .*; is CYCLONEDDS_URI=.* right"):
        DdsTransport(DOMAIN._replace(domain=152)).open()
