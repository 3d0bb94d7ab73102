import os
import socket
import subprocess
import sys

import pytest

from mav_robot_status.links.owner import device_owner, port_owner


def me() -> str:
    with open("/proc/self/comm", encoding="utf-8") as comm:
        return f"{comm.read().strip()} (pid {os.getpid()})"


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
@pytest.mark.parametrize(("protocol", "kind"), [("udp", socket.SOCK_DGRAM), ("tcp", socket.SOCK_STREAM)])
def test_a_port_has_an_owner_while_it_is_held(host: str, protocol: str, kind: socket.SocketKind) -> None:
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, kind) as holder:
        holder.bind((host, 0))
        port = holder.getsockname()[1]
        if protocol == "tcp":
            holder.listen()
        assert port_owner(port, protocol) == me()
    assert port_owner(port, protocol) == ""


def test_a_tcp_client_does_not_own_the_port() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as client:
        assert port_owner(client.getsockname()[1], "tcp") == ""


def test_a_device_has_an_owner_while_it_is_open() -> None:
    master, slave = os.openpty()
    name = os.ttyname(slave)
    with subprocess.Popen(
        [sys.executable, "-c", f"file = open({name!r}); print(flush=True); input()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as holder:
        os.close(slave)
        assert holder.stdout
        assert holder.stdout.readline() == b"\n"
        assert device_owner(name).endswith(f"(pid {holder.pid})")
        holder.communicate(b"\n")
    assert device_owner(name) == ""
    os.close(master)


def test_a_missing_device_has_no_owner() -> None:
    assert device_owner("/dev/no such device") == ""
