"""Serial links: a device that may be plugged in later, unplugged and plugged in again."""

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
from mav_robot_status.link.owner import device_owner
from mav_robot_status.link.retry import Backoff, Chance, Changes
from mav_robot_status.link.stream import Reconnecting, reason
from mav_robot_status.link.url import Url

if TYPE_CHECKING:
    from serial import Serial

log = logging.getLogger(__name__)

RETRY = 0.2, 2.0
"""Seconds between attempts to open the device: the first wait, the longest."""
SHARED = {0, 1, *range(136, 144)}
"""Major numbers of what others may have open too: files that are no devices, /dev/null and its kin, and the
pseudo-terminals of simulators, which often keep both ends."""

_HELD = (errno.EBUSY, errno.EWOULDBLOCK)  # TIOCEXCL, flock
_GONE = (errno.EIO, errno.ENXIO, errno.ENODEV, errno.ENOTCONN)
_WORDS = {
    errno.ENOENT: "not there",
    errno.EPERM: "not allowed; a container must be given the device",
    errno.ENOTTY: "not a serial device",
    errno.EISDIR: "not a serial device",
    errno.EINVAL: "it refuses {baud} baud",
}
_FOR_GOOD = (errno.EACCES, errno.EPERM, errno.ENOTTY, errno.EISDIR, errno.EINVAL)


class SerialLink(Reconnecting):
    """Kind `serial`: a device, for us alone (TIOCEXCL and flock), in raw mode without flow control."""

    seeking = "waiting for"

    def __init__(self, url: Url, chance: Chance = random.random) -> None:
        """Open the device if it is there.

        Raises LinkError for what waiting does not mend: no permission, no serial device, a baud rate that it refuses.
        """
        super().__init__(url.words(), url.device, Backoff(*RETRY, chance), Changes(log))
        self._baud = url.baud
        self._port: Serial | None = None
        try:
            self._port = _opened(self._where, self._baud)
        except OSError as error:  # else `service` tries again, and tells
            if error.errno in _FOR_GOOD:
                self.close()
                raise LinkError(f"{self._where}: {error.strerror}") from None

    def _connect(self, now: float) -> None:
        try:
            self._port = self._port or _opened(self._where, self._baud)
            self._connected(self._port.fileno(), now)
        except OSError as error:  # nothing is for good here: after plugging in, udev sets permissions a little late
            self._release()
            self._retry(error.strerror or str(error), now)

    def _why(self, error: OSError) -> str:
        return "unplugged" if error.errno in _GONE else reason(error)

    def _release(self) -> None:
        if self._port is None:
            return
        for step in (
            lambda fd: termios.tcflush(fd, termios.TCOFLUSH),  # closing would wait until it is sent
            lambda fd: fcntl.ioctl(fd, termios.TIOCNXCL),  # it stays set where somebody else has it open too
        ):
            with suppress(OSError, termios.error):
                step(self._port.fileno())
        self._port.close()
        self._port = None


def _opened(device: str, baud: int) -> Serial:
    """The device, opened. Raises OSError, whose `strerror` says in words for a person why that is not possible."""
    from serial import Serial

    # inter_byte_timeout 0 sets VMIN to 1: with 0, a read does not tell "nothing there" from "unplugged"
    port = Serial(None, baud, exclusive=True, inter_byte_timeout=0)
    port.port = device
    try:
        if os.major(os.stat(device).st_rdev) not in SHARED and device_owner(device):
            raise OSError(errno.EBUSY, "")  # many programs do not lock; both would get parts of what comes
        port.open()
        fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
        rate = termios.tcgetattr(port.fileno())[5]
        if rate != getattr(termios, f"B{baud}", rate):
            raise OSError(errno.EINVAL, "")  # the driver took another rate, and did not say so
    except (OSError, ValueError, termios.error) as error:
        port.close()
        code = _code(error)
        raise OSError(code, _words(code, device, baud)) from None
    return port


def _code(error: BaseException) -> int:
    """The error number in what pyserial raises; ValueError is for a baud rate that the device refuses."""
    if isinstance(error, ValueError):
        return errno.EINVAL
    numbers = [one.args[0] for one in (error, error.__context__) if one and one.args and isinstance(one.args[0], int)]
    return numbers[0] if numbers else errno.EIO


def _words(code: int, device: str, baud: int) -> str:
    """Why a device cannot be used, and what would help."""
    if code in _HELD:
        return f"held by {device_owner(device) or 'another program'}"
    if code == errno.EACCES:
        return _permission(device)
    return _WORDS.get(code, os.strerror(code).lower()).format(baud=baud)


def _permission(device: str) -> str:
    """What to do about a missing permission."""
    with suppress(OSError, KeyError):
        found = os.stat(device)
        if found.st_mode & 0o060 == 0o060:
            group = grp.getgrgid(found.st_gid).gr_name
            return f"no permission; its group is {group}: sudo usermod -aG {group} $USER, then log in again"
        return f"no permission; it is {stat.filemode(found.st_mode)}, only its owner {found.st_uid} may use it"
    return "no permission"
