"""A machine for classic BPF, as the kernel runs it on a datagram. For tests."""

from __future__ import annotations

import struct

UDP_HEADER = 8
SIZES = {0x00: 4, 0x08: 2, 0x10: 1}


def passes(program: bytes, datagram: bytes) -> bool:
    """Whether the kernel passes a datagram to a UDP socket with this program: an array of struct sock_filter."""
    return run(program, bytes(UDP_HEADER) + datagram) > 0


def run(program: bytes, packet: bytes) -> int:
    """What a program returns. Raises AssertionError for what the kernel would refuse."""
    code: list[tuple[int, int, int, int]] = list(struct.iter_unpack("=HBBI", program))
    assert 0 < len(code) <= 4096
    a = x = at = 0
    while True:
        operation, yes, no, k = code[at]
        at += 1
        kind, source = operation & 0x07, x if operation & 0x08 else k
        if kind == 0x06:
            return k
        if operation == 0x80:
            a = len(packet)
        elif kind == 0x00:
            assert operation & 0xE0 == 0x20
            size = SIZES[operation & 0x18]
            if k + size > len(packet):
                return 0  # a load behind the end drops the packet
            a = int.from_bytes(packet[k : k + size], "big")
        elif operation == 0x07:
            x = a
        elif kind == 0x04:
            a = {0x00: a + source, 0x50: a & source}[operation & 0xF0] & 0xFFFFFFFF
        elif operation == 0x05:
            at += k
        else:
            assert kind == 0x05
            at += yes if {0x10: a == source, 0x20: a > source, 0x30: a >= source}[operation & 0xF0] else no
