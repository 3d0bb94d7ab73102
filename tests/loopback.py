"""Cyclone DDS on the loopback interface only, without multicast: nothing leaves this computer."""

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    '<AllowMulticast>false</AllowMulticast></General><Discovery><Peers><Peer address="127.0.0.1"/></Peers>'
    "<ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
"""For the environment variable CYCLONEDDS_URI."""
