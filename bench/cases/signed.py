"""A link with only signed frames, compared with the same traffic without signatures."""

from __future__ import annotations

from .. import workload
from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import free_port
from ..results import OURS, PYMAVLINK, Sample, Skip, Target

METRIC = "CPU per frame, us"
PLAIN, SIGNED = "unsigned", "signed"
RATE = 4000
SECONDS = 3.0
KEY = bytes(range(32))


def measure(bench: Bench) -> Found:
    """One round."""
    has = bench.contenders.has_option("--signing-key")
    if not has:
        yield Skip(SIGNED, OURS, "this version lacks the option --signing-key")
    key_file = bench.place / "signing.key"
    key_file.write_text(KEY.hex() + "\n")
    key_file.chmod(0o600)
    ours: dict[str, tuple[str, ...]] = {PLAIN: (), SIGNED: ("--signing-key", str(key_file))}
    pymavlink: dict[str, tuple[str, ...]] = {PLAIN: (), SIGNED: ("10", KEY.hex())}
    for setup in (PLAIN, SIGNED):
        if has or setup == PLAIN:
            yield from _one(bench, setup, OURS, ours[setup])
        yield from _one(bench, setup, PYMAVLINK, pymavlink[setup])


def _one(bench: Bench, setup: str, who: str, arguments: tuple[str, ...]) -> Found:
    seconds, before = bench.lasting(SECONDS), bench.lasting(1.0)
    # a receiver accepts a signed frame only once, so the file has one for every frame that is sent
    frames = bench.place / "signed.frames"
    if setup == SIGNED:
        workload.save(frames, workload.frames(round(RATE * (seconds + before)) + 1, key=KEY))
    start = bench.contenders.start_ours if who == OURS else bench.contenders.start_pymavlink
    port = free_port()
    path = frames if setup == SIGNED else bench.frames()
    with start(port, *arguments) as child, Feed(path, port) as feed:
        child.listens(port)
        feed.warm_up(RATE, before)
        fed = feed.measure(child, RATE, seconds)
        yield Sample(setup, METRIC, who, fed.per_frame, fed.note)


CASE = Case(
    "signed",
    f"A signed link, {RATE} frames/s",
    measure,
    (Target(SIGNED, METRIC, "signed link: at most 1/3 of pymavlink's CPU", 1 / 3, peer=PYMAVLINK),),
)
