"""Gets the table of PX4's events for each PX4 on the links: from the cache, else from the vehicle.

The vehicle sends COMPONENT_METADATA because it is asked for it once, see `autopilots.wanted`. Then the cache is looked
up by the checksum in it; a table that is not there is read over MAVLink FTP, one at a time on each link. So the second
vehicle of a fleet finds the table of the first one in memory. Disk and parser run off the loop.

Nothing is sent on a passive link. If a table cannot be fetched, one log line says so. It is tried again after a
minute at the earliest, and only if the vehicle offers its metadata again, as it does after a reboot.
"""

from __future__ import annotations

import logging
import math
from collections import OrderedDict
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...hardware.mavlink.autopilots.wanted import METADATA
from ...hardware.mavlink.requests.scheduler import Ask
from ...interface import LinkState
from ...mavlink.decode import text
from ...mavlink.definitions import ComponentMetadata, FileTransferProtocol
from ...mavlink.ftp.download import Failure
from ...mavlink.ftp.payload import message, unpack
from ...mavlink.ftp.table_download import TableDownload
from ...paced_log import BURST, PacedLog
from .worker import Worker

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from ...hardware.mavlink.px4_events import EventTable
    from ...hardware.mavlink.vehicle import TrackedVehicle
    from ..links.channel import Channel
    from ..links.endpoint import Endpoint
    from ..links.link_hub import LinkHub
    from .cache import EventTableCache

log = logging.getLogger(__name__)

SERIAL_RATE, RATE = 1000.0, 20_000.0
"""Bytes a second that a transfer may take, both ways together."""
AGAIN: Final = 60.0  # s from the start of one attempt to the next one for the same vehicle
LOOK: Final = 0.05  # s until the results of the worker are looked at
ROOM: Final = 0.2  # s until a link without room, or whose turn it is not, is looked at again
LOST: Final = 1.0  # s until a lost vehicle is looked at again
MOST_TABLES: Final = 8
"""Tables kept in memory, for the other vehicles of a fleet."""

Ids = tuple[int, int]


class Offer(NamedTuple):
    """What COMPONENT_METADATA says."""

    crc: int
    """The checksum of the general file; 0 if the vehicle does not know it."""
    uri: str


class _Stage(Enum):
    OFFERED = 0
    READING = 1
    """In the worker."""
    WAITING = 2
    """For its turn on the link."""
    FETCHING = 3
    HAS_TABLE = 4
    GIVEN_UP = 5


class _Vehicle:
    """One vehicle that has offered its metadata."""

    __slots__ = ("channel", "download", "due", "offer", "stage", "started")

    def __init__(self, offer: Offer, due: float) -> None:
        self.offer = offer
        self.stage = _Stage.OFFERED
        self.due = due
        """When (monotonic seconds) there is something to do for it."""
        self.started = due
        self.download: TableDownload | None = None
        self.channel: Channel | None = None
        """The channel on which files are decoded for it."""


class EventTables:
    """The tables of the vehicles of one hub. The loop calls `on_message` and `due`; neither waits nor raises."""

    def __init__(
        self,
        hub: LinkHub,
        use: Callable[[Ids, EventTable], None],
        parse: Callable[[bytes], EventTable],
        cache: EventTableCache | None = None,
    ) -> None:
        """`parse` makes a table from the bytes of its file, off the loop, and raises ValueError; `use` gets it."""
        self._hub = hub
        self._use = use
        self._parse = parse
        self.cache = cache
        self.wanted = True
        """Whether tables are looked for at all."""
        self.files: dict[Ids, bytes] | None = None
        """If not None: the file of each vehicle is kept here."""
        self.given_up: dict[Ids, str] = {}
        """Why there is no table, by vehicle."""
        self._vehicles: dict[Ids, _Vehicle] = {}
        self._tables: OrderedDict[int, Any] = OrderedDict()
        """Tables by the checksum in the offer."""
        self._busy: set[Endpoint] = set()
        """The links on which a transfer runs."""
        self._coming: set[int] = set()
        """The checksums of the offers whose tables are on their way."""
        self._worker = Worker("tables of events")
        self._paced, self._now = PacedLog(log, *BURST), -math.inf
        self.next_due = math.inf
        """When (monotonic seconds) `due` has something to do."""

    @property
    def offers(self) -> Collection[Ids]:
        """The vehicles that have told where their metadata is."""
        return self._vehicles.keys()

    # received

    def on_message(self, tracked: TrackedVehicle, received: Any, now: float) -> None:
        """Process COMPONENT_METADATA or FILE_TRANSFER_PROTOCOL of a vehicle, from its selected channel."""
        if tracked.ids is None or tracked.state is None:
            return
        if type(received) is FileTransferProtocol:
            self._on_answer(tracked.ids, received, now)
        elif type(received) is ComponentMetadata and self.wanted and METADATA in tracked.state.profile.requests.once:
            self._offered(tracked.ids, Offer(received.file_crc, text(received.uri)), now)

    def _offered(self, ids: Ids, offer: Offer, now: float) -> None:
        before = self._vehicles.get(ids)
        due = now
        if before is not None:
            if before.offer == offer and before.stage is not _Stage.GIVEN_UP:
                if before.stage is _Stage.HAS_TABLE and offer.crc in self._tables:  # the state of the vehicle is new
                    self._use(ids, self._tables[offer.crc])
                return
            due = max(now, before.started + AGAIN)
            self._stop_hearing(before)
        self._vehicles[ids] = _Vehicle(offer, due)
        self.next_due = min(self.next_due, due)

    def _on_answer(self, ids: Ids, received: FileTransferProtocol, now: float) -> None:
        """Process an answer of a file server, if it is for us."""
        vehicle = self._vehicles.get(ids)
        own = self._hub.sender.component
        if vehicle is None or vehicle.download is None or received.target_system != own.system_for(ids[0]):
            return
        answer = unpack(received.payload)
        if answer is not None and received.target_component in (0, own.id):
            vehicle.download.heard(answer, now)
            vehicle.due = now if vehicle.download.outcome is not None else vehicle.download.next_due()
            self.next_due = min(self.next_due, vehicle.due)

    # due

    def due(self, now: float, find: Callable[[int, int], TrackedVehicle | None]) -> list[Ask]:
        """Do what is due at `now`; the requests to send. `find` finds a vehicle."""
        self._now = now
        self._worker.finish()
        self._busy = {vehicle.channel.endpoint for vehicle in self._vehicles.values() if vehicle.channel is not None}
        coming = (_Stage.FETCHING, _Stage.READING)
        self._coming = {vehicle.offer.crc for vehicle in self._vehicles.values() if vehicle.stage in coming} - {0}
        asks = []
        for ids, vehicle in list(self._vehicles.items()):
            tracked = find(*ids)
            if tracked is None:
                self._stop_hearing(vehicle)
                del self._vehicles[ids]
                self.given_up.pop(ids, None)
            elif now >= vehicle.due:
                ask = self._step(ids, vehicle, tracked, now)
                if ask is not None:
                    asks.append(ask)
        self.next_due = min((vehicle.due for vehicle in self._vehicles.values()), default=math.inf)
        if self._worker.busy:
            self.next_due = min(self.next_due, now + LOOK)
        return asks

    def _step(self, ids: Ids, vehicle: _Vehicle, tracked: TrackedVehicle, now: float) -> Ask | None:
        if vehicle.stage in (_Stage.OFFERED, _Stage.WAITING) and vehicle.offer.crc in self._tables:
            self._tell(ids, "it uses the table of events of another vehicle")
            self._give(ids, vehicle, self._tables[vehicle.offer.crc])
        elif vehicle.stage is _Stage.OFFERED:
            self._look_up(ids, vehicle, now)
        elif vehicle.stage is _Stage.WAITING:
            self._begin(ids, vehicle, now)
        elif vehicle.download is not None:
            return self._continue(ids, vehicle, vehicle.download, tracked, now)
        return None

    def _look_up(self, ids: Ids, vehicle: _Vehicle, now: float) -> None:
        """Look for a table in the cache."""
        crc, cache = vehicle.offer.crc, self.cache
        vehicle.started = now
        if crc == 0 or cache is None:
            vehicle.stage = _Stage.WAITING
        else:
            vehicle.stage, vehicle.due = _Stage.READING, math.inf
            self._worker.do(lambda: self._load(cache, crc), lambda table: self._looked_up(ids, vehicle, table))

    def _load(self, cache: EventTableCache, crc: int) -> Any:
        """In the worker: the table of the cache, or None. A damaged one is fetched anew."""
        data = cache.load(crc)
        try:
            return None if data is None else self._parse(data)
        except ValueError:
            return None

    def _looked_up(self, ids: Ids, vehicle: _Vehicle, table: Any) -> None:
        if table is None:
            vehicle.stage, vehicle.due = _Stage.WAITING, -math.inf
        else:
            self._tell(ids, "the table of its events is in the cache")
            self._keep(vehicle.offer.crc, table)
            self._give(ids, vehicle, table)

    def _begin(self, ids: Ids, vehicle: _Vehicle, now: float) -> None:
        """Start a transfer, when it is its turn on its link."""
        channel = self._hub.members.channel_of(ids)
        if channel is not None and channel.passive:
            vehicle.stage, vehicle.due = _Stage.GIVEN_UP, math.inf
            self.given_up[ids] = "nothing may be sent on its link"
        elif channel is None or channel.endpoint in self._busy or vehicle.offer.crc in self._coming:
            vehicle.due = now + ROOM
        else:
            self._busy.add(channel.endpoint)
            rate = SERIAL_RATE if channel.endpoint.is_serial else RATE
            vehicle.stage, vehicle.due = _Stage.FETCHING, now
            vehicle.download = TableDownload(vehicle.offer.uri, vehicle.offer.crc, ids[1], rate=rate, now=now)

    def _continue(
        self, ids: Ids, vehicle: _Vehicle, download: TableDownload, tracked: TrackedVehicle, now: float
    ) -> Ask | None:
        """Send the next request of a transfer, if the link has room. Note its outcome."""
        channel = self._hub.members.channel_of(ids)
        if channel is None or channel.passive or tracked.handle.detail.link is not LinkState.CONNECTED:
            self._stop_hearing(vehicle)  # meanwhile another vehicle of the link may have its turn
            vehicle.due = now + LOST
            return None
        if download.outcome is not None and vehicle.stage is _Stage.FETCHING:
            self._fetched(ids, vehicle, download.outcome, now)
        if download.ended:
            vehicle.due, vehicle.download = math.inf, None
            self._stop_hearing(vehicle)
            return None
        if not self._hub.may_ask(ids, 0):
            vehicle.due = now + ROOM
            return None
        self._hear(vehicle, channel)
        request = download.due(now)
        vehicle.due = now if download.ended else download.next_due()
        return None if request is None else Ask(*ids, message(request, *ids))

    def _hear(self, vehicle: _Vehicle, channel: Channel) -> None:
        """Decode files on this channel only."""
        if vehicle.channel is not channel:
            self._stop_hearing(vehicle)
        vehicle.channel = channel
        channel.hear_files(True)

    def _stop_hearing(self, vehicle: _Vehicle) -> None:
        if vehicle.channel is not None:
            vehicle.channel.hear_files(False)
            vehicle.channel = None

    # outcomes

    def _tell(self, ids: Ids, what: str) -> None:
        self._paced(logging.INFO, self._now, f"vehicle {ids[0]}.{ids[1]}: {what}")

    def _fetched(self, ids: Ids, vehicle: _Vehicle, outcome: bytes | Failure, now: float) -> None:
        vehicle.stage = _Stage.READING
        if isinstance(outcome, Failure):
            self._give_up(ids, vehicle, outcome.reason)
            return
        seconds = now - vehicle.started
        self._tell(ids, f"the table of its events is read, {len(outcome)} bytes in {seconds:.1f} s")
        self._worker.do(
            lambda: self._parse_and_store(vehicle.offer.crc, outcome),
            lambda table: self._parsed(ids, vehicle, outcome, table),
        )

    def _parse_and_store(self, crc: int, data: bytes) -> Any:
        """In the worker: the table, or the ValueError of the parser."""
        try:
            table = self._parse(data)
        except ValueError as error:
            return error
        if crc and self.cache is not None:
            self.cache.store(crc, data)
        return table

    def _parsed(self, ids: Ids, vehicle: _Vehicle, data: bytes, table: Any) -> None:
        if isinstance(table, ValueError):
            self._give_up(ids, vehicle, f"it cannot be read: {table}")
            return
        if self.files is not None:
            self.files[ids] = data
        self._keep(vehicle.offer.crc, table)
        self._give(ids, vehicle, table)

    def _keep(self, crc: int, table: Any) -> None:
        if crc:
            self._tables[crc] = table
            while len(self._tables) > MOST_TABLES:
                self._tables.popitem(last=False)

    def _give(self, ids: Ids, vehicle: _Vehicle, table: Any) -> None:
        if self._vehicles.get(ids) is not vehicle:  # it is gone, or was replaced meanwhile
            return
        vehicle.stage = _Stage.HAS_TABLE
        if vehicle.download is None:
            vehicle.due = math.inf
        self.given_up.pop(ids, None)
        self._use(ids, table)

    def _give_up(self, ids: Ids, vehicle: _Vehicle, reason: str) -> None:
        vehicle.stage = _Stage.GIVEN_UP
        if self._vehicles.get(ids) is vehicle:
            self.given_up[ids] = reason
            self._tell(ids, f"no table of its events: {reason}")

    def close(self) -> None:
        """The last call: a table that was just read may still be on its way to the disk."""
        self._worker.close()

    def waits_for(self) -> list[str]:
        """The vehicles whose table may still come, one line for each."""
        ended = (_Stage.HAS_TABLE, _Stage.GIVEN_UP)
        waiting = [ids for ids, vehicle in self._vehicles.items() if vehicle.stage not in ended]
        return ["vehicle {}.{}: the table of its events".format(*ids) for ids in waiting]

    def progress(self, ids: Ids) -> tuple[int, int] | None:
        """The bytes of the table received so far and its size, while it is fetched."""
        vehicle = self._vehicles.get(ids)
        return None if vehicle is None or vehicle.download is None else vehicle.download.progress
