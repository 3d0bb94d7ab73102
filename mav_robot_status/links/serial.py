"""Serial links. The device may be plugged in later, unplugged, and plugged in again."""

from __future__ import annotations

import errno
import fcntl
import grp
import logging
import os
import random
import stat
import termios
from contextlib import suppress
from typing import TYPE_CHECKING

from mav_robot_status.errors import LinkError
from mav_robot_status.links.owner import device_owner
from mav_robot_status.links.retry import Backoff, RandomFraction, StateLog
from mav_robot_status.links.stream import Reconnecting, reason
from mav_robot_status.links.url import Url

if TYPE_CHECKING:
    from serial import Serial

log = logging.getLogger(__name__)

RETRY = 0.2, 2.0
"""Seconds between attempts to open the device: first, longest."""
SHARED = {0, 1, *range(136, 144)}
"""Major numbers that other processes may have open too: regular files, /dev/null and its group, and pseudo-terminals,
which a simulator often keeps open at both ends."""

_HELD = (errno.EBUSY, errno.EWOULDBLOCK)  # TIOCEXCL, flock
_GONE = (errno.EIO, errno.ENXIO, errno.ENODEV, errno.ENOTCONN)
_REASONS = {
    errno.ENOENT: "no such device",
    errno.EPERM: "not allowed; give the container access to the device",
    errno.ENOTTY: "not a serial device",
    errno.EISDIR: "not a serial device",
    errno.EINVAL: "the device refuses {baud} baud",
}
_FOR_GOOD = (errno.EACCES, errno.EPERM, errno.ENOTTY, errno.EISDIR, errno.EINVAL)


class SerialLink(Reconnecting):
    """Kind `serial`: a device, opened exclusively (TIOCEXCL and flock), in raw mode without flow control."""

    attempting = "waiting for"

    def __init__(self, url: Url, fraction: RandomFraction = random.random) -> None:
        """Open the device if it exists.

        Raises LinkError if a retry cannot help: no permission, not a serial device, an unsupported baud rate.
        """
        super().__init__(url.words(), url.device, Backoff(*RETRY, fraction), StateLog(log))
        self._baud = url.baud
        self._port: Serial | None = None
        try:
            self._port = _opened(self._where, self._baud)
        except OSError as error:  # `service` retries after every other error, and logs it
            if error.errno in _FOR_GOOD:
                self.close()
                raise LinkError(f"{self._where}: {error.strerror}") from None

    def _connect(self, now: float) -> None:
        try:
            self._port = self._port or _opened(self._where, self._baud)
            self._connected(self._port.fileno(), now)
        except OSError as error:  # always retried: udev sets permissions a moment after the device appears
            self._release()
            self._retry(error.strerror or str(error), now)

    def _why(self, error: OSError) -> str:
        return "unplugged" if error.errno in _GONE else reason(error)

    def _release(self) -> None:
        if self._port is None:
            return
        for step in (
            lambda fd: termios.tcflush(fd, termios.TCOFLUSH),  # else closing waits until all is sent
            lambda fd: fcntl.ioctl(fd, termios.TIOCNXCL),  # else it stays set while another process has the device open
        ):
            with suppress(OSError, termios.error):
                step(self._port.fileno())
        self._port.close()
        self._port = None


def _opened(device: str, baud: int) -> Serial:
    """The open device. Raises OSError with a readable reason in `strerror`."""
    from serial import Serial

    # inter_byte_timeout 0 sets VMIN to 1: with VMIN 0 a read cannot distinguish "no data" from "unplugged"
    port = Serial(None, baud, exclusive=True, inter_byte_timeout=0)
    port.port = device
    try:
        if os.major(os.stat(device).st_rdev) not in SHARED and device_owner(device):
            raise OSError(
                errno.EBUSY, ""
            )  # many programs do not lock the device; each would receive a part of the data
        port.open()
        fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
        rate = termios.tcgetattr(port.fileno())[5]
        if rate != getattr(termios, f"B{baud}", rate):
            raise OSError(errno.EINVAL, "")  # the driver has silently set another rate
    except (OSError, ValueError, termios.error) as error:
        port.close()
        code = _code(error)
        raise OSError(code, _failure(code, device, baud)) from None
    return port


def _code(error: BaseException) -> int:
    """The error number of an exception of pyserial; ValueError means an unsupported baud rate."""
    if isinstance(error, ValueError):
        return errno.EINVAL
    numbers = [one.args[0] for one in (error, error.__context__) if one and one.args and isinstance(one.args[0], int)]
    return numbers[0] if numbers else errno.EIO


def _failure(code: int, device: str, baud: int) -> str:
    """Why a device cannot be opened, and what to do."""
    if code in _HELD:
        return f"held by {device_owner(device) or 'another program'}"
    if code == errno.EACCES:
        return _permission(device)
    return _REASONS.get(code, os.strerror(code).lower()).format(baud=baud)


def _permission(device: str) -> str:
    """What to do about missing permissions."""
    with suppress(OSError, KeyError):
        found = os.stat(device)
        if found.st_mode & 0o060 == 0o060:
            group = grp.getgrgid(found.st_gid).gr_name
            return f"no permission; its group is {group}: sudo usermod -aG {group} $USER, then log in again"
        return f"no permission; it is {stat.filemode(found.st_mode)}, only its owner {found.st_uid} may use it"
    return "no permission"
