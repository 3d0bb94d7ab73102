from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.gateway.paths import APART, MOST_WAYS, PROOFS, SILENCE, Paths
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.mavlink.framing import Frame, Parser

VEHICLE = (1, 1)


def beat(ids: tuple[int, int] = VEHICLE) -> Frame:
    return Frame(0, ids, 0, mav.Heartbeat(0, 2, 3, 0, 3, 3), b"")


def attitude(clock_ms: int) -> Frame:
    return Frame(30, VEHICLE, 0, mav.Attitude(clock_ms, 0.0, 0.0, 0.0), b"")


def heard(paths: Paths[str], frame: Frame, way: str, now: float) -> bool:
    counts = paths.counts(frame, way, now)
    if counts and frame.message_id == 0:
        paths.learn(frame.ids, way, now)
    return counts


def test_the_first_way_counts_and_copies_on_another_do_not() -> None:
    paths: Paths[str] = Paths()
    for second in range(10):
        assert heard(paths, beat(), "radio", second)
        assert not heard(paths, beat(), "wifi", second + 0.1)
    assert paths.duplicates == 10
    assert paths.way(VEHICLE) == "radio"


def test_a_silent_way_is_left_before_the_link_counts_as_lost() -> None:
    paths: Paths[str] = Paths()
    heard(paths, beat(), "radio", 0.0)
    taken = [now / 10 for now in range(40) if heard(paths, beat(), "wifi", now / 10)]
    assert SILENCE < taken[0] < 3.5
    assert paths.way(VEHICLE) == "wifi"
    assert paths.changes == 1


def test_only_a_heartbeat_takes_another_way() -> None:
    paths: Paths[str] = Paths()
    heard(paths, beat(), "radio", 0.0)
    assert not heard(paths, attitude(1000), "wifi", 9.0)
    assert heard(paths, beat(), "wifi", 9.1)
    assert heard(paths, attitude(1000), "wifi", 9.2)
    assert not heard(paths, attitude(1000), "radio", 9.3)


def test_whatever_no_vehicle_sends_counts_on_every_way() -> None:
    paths: Paths[str] = Paths()
    heard(paths, beat(), "radio", 0.0)
    assert all(paths.counts(beat((255, 190)), way, 0.1) for way in ("radio", "wifi"))
    assert paths.duplicates == 0


def interleaved(paths: Paths[str], boots: dict[str, float], seconds: int) -> list[tuple[str, str]]:
    """Each end tells its clock four times a second; the conflicts that this shows."""
    found = []
    for quarter in range(4 * seconds):
        now = 100.0 + quarter / 4
        for way, booted in boots.items():
            if quarter % 4 == 0:
                heard(paths, beat(), way, now)
            frame = attitude(int((now - booted) * 1000))
            if not heard(paths, frame, way, now) and (ends := paths.conflict(frame, way)):
                found.append(ends)
    return found


def test_one_vehicle_on_two_ways_has_booted_once_however_slow_one_of_them_is() -> None:
    assert interleaved(Paths(), {"radio": 10.0, "wifi": 10.0 + APART - 1}, 20) == []


def test_two_vehicles_with_one_id_are_told_apart_by_their_clocks() -> None:
    found = interleaved(Paths(), {"north": 10.0, "south": 60.0}, 20)
    assert set(found) == {("north", "south")}
    assert len(found) >= 80 // PROOFS - 1


def test_a_reboot_heard_on_two_ways_is_no_conflict() -> None:
    paths: Paths[str] = Paths()
    assert interleaved(paths, {"radio": 10.0, "wifi": 10.0}, 5) == []
    # the second way tells the new boot time first, and the other one half a second later
    for now in (105.5, 105.6, 105.7, 105.8):
        frame = attitude(int((now - 105.0) * 1000))
        assert not heard(paths, frame, "wifi", now)
        assert paths.conflict(frame, "wifi") is None
    assert interleaved(paths, {"radio": 99.0, "wifi": 99.0}, 5) == []


@given(
    st.lists(
        st.tuples(st.sampled_from([0, 2, 30, 33, 1]), st.binary(max_size=12), st.integers(0, 20), st.floats(0, 5)),
        max_size=60,
    )
)
def test_whatever_comes_nothing_raises_and_the_ways_stay_few(frames: list[tuple[int, bytes, int, float]]) -> None:
    paths: Paths[str] = Paths()
    now = 0.0
    for message_id, payload, way, step in frames:
        now += step
        (frame,) = Parser(None).feed(enclose(message_id, payload, system=1, component=1, sequence=0))
        if not heard(paths, frame, str(way), now):
            paths.conflict(frame, str(way))
    assert all(len(path.others) <= MOST_WAYS for path in paths._paths.values())


def test_a_vehicle_goes_on_over_the_way_heard_last_of_those_that_stay() -> None:
    paths: Paths[str] = Paths()
    heard(paths, beat(), "radio", 0.0)
    heard(paths, beat(), "cable", 0.1)
    heard(paths, beat(), "wifi", 0.2)
    paths.keep(lambda way: way != "radio")
    assert paths.way(VEHICLE) == "wifi"
    assert heard(paths, beat(), "wifi", 0.3)


def test_a_vehicle_that_was_heard_on_no_way_that_stays_is_forgotten() -> None:
    paths: Paths[str] = Paths()
    heard(paths, beat(), "radio", 0.0)
    heard(paths, beat((2, 1)), "cable", 0.0)
    heard(paths, beat((2, 1)), "radio", 0.1)
    paths.keep(lambda way: way == "cable")
    assert list(paths.vehicles()) == [(2, 1)]
    assert not paths.counts(beat((2, 1)), "radio", 0.2)
