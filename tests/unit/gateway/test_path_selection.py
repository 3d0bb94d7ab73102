from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.gateway.path_selection import APART, MOST_ROUTES, PROOFS, SILENCE, PathSelection
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.mavlink.framing import Frame, Parser

VEHICLE = (1, 1)


def beat(ids: tuple[int, int] = VEHICLE) -> Frame:
    return Frame(0, ids, 0, mav.Heartbeat(0, 2, 3, 0, 3, 3), b"")


def attitude(clock_ms: int) -> Frame:
    return Frame(30, VEHICLE, 0, mav.Attitude(clock_ms, 0.0, 0.0, 0.0), b"")


def heard(paths: PathSelection[str], frame: Frame, way: str, now: float) -> bool:
    counts = paths.accepts(frame, way, now)
    if counts and frame.message_id == 0:
        paths.learn(frame.ids, way, now)
    return counts


def test_frames_of_the_first_path_count_and_copies_on_another_path_do_not() -> None:
    paths: PathSelection[str] = PathSelection()
    for second in range(10):
        assert heard(paths, beat(), "radio", second)
        assert not heard(paths, beat(), "wifi", second + 0.1)
    assert paths.duplicates == 10
    assert paths.channel(VEHICLE) == "radio"


def test_a_silent_path_is_replaced_before_the_link_is_lost() -> None:
    paths: PathSelection[str] = PathSelection()
    heard(paths, beat(), "radio", 0.0)
    taken = [now / 10 for now in range(40) if heard(paths, beat(), "wifi", now / 10)]
    assert SILENCE < taken[0] < 3.5
    assert paths.channel(VEHICLE) == "wifi"
    assert paths.changes == 1


def test_only_a_heartbeat_selects_another_path() -> None:
    paths: PathSelection[str] = PathSelection()
    heard(paths, beat(), "radio", 0.0)
    assert not heard(paths, attitude(1000), "wifi", 9.0)
    assert heard(paths, beat(), "wifi", 9.1)
    assert heard(paths, attitude(1000), "wifi", 9.2)
    assert not heard(paths, attitude(1000), "radio", 9.3)


def test_messages_of_other_senders_count_on_every_path() -> None:
    paths: PathSelection[str] = PathSelection()
    heard(paths, beat(), "radio", 0.0)
    assert all(paths.accepts(beat((255, 190)), way, 0.1) for way in ("radio", "wifi"))
    assert paths.duplicates == 0


def interleaved(paths: PathSelection[str], boots: dict[str, float], seconds: int) -> list[tuple[str, str]]:
    """Each vehicle sends its boot clock four times a second. Returns the detected conflicts."""
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


def test_a_slow_second_path_does_not_show_a_reboot() -> None:
    assert interleaved(PathSelection(), {"radio": 10.0, "wifi": 10.0 + APART - 1}, 20) == []


def test_two_vehicles_with_the_same_id_are_distinguished_by_their_boot_clocks() -> None:
    found = interleaved(PathSelection(), {"north": 10.0, "south": 60.0}, 20)
    assert set(found) == {("north", "south")}
    assert len(found) >= 80 // PROOFS - 1


def test_a_reboot_seen_on_two_paths_is_not_a_conflict() -> None:
    paths: PathSelection[str] = PathSelection()
    assert interleaved(paths, {"radio": 10.0, "wifi": 10.0}, 5) == []
    # the second path shows the new boot time first, the other one half a second later
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
def test_any_traffic_is_accepted_and_the_number_of_paths_stays_bounded(
    frames: list[tuple[int, bytes, int, float]],
) -> None:
    paths: PathSelection[str] = PathSelection()
    now = 0.0
    for message_id, payload, way, step in frames:
        now += step
        (frame,) = Parser(None).feed(enclose(message_id, payload, system=1, component=1, sequence=0))
        if not heard(paths, frame, str(way), now):
            paths.conflict(frame, str(way))
    assert all(len(path.others) <= MOST_ROUTES for path in paths._paths.values())


def test_a_vehicle_continues_on_the_most_recent_remaining_path() -> None:
    paths: PathSelection[str] = PathSelection()
    heard(paths, beat(), "radio", 0.0)
    heard(paths, beat(), "cable", 0.1)
    heard(paths, beat(), "wifi", 0.2)
    paths.keep(lambda way: way != "radio")
    assert paths.channel(VEHICLE) == "wifi"
    assert heard(paths, beat(), "wifi", 0.3)


def test_a_vehicle_without_a_remaining_path_is_forgotten() -> None:
    paths: PathSelection[str] = PathSelection()
    heard(paths, beat(), "radio", 0.0)
    heard(paths, beat((2, 1)), "cable", 0.0)
    heard(paths, beat((2, 1)), "radio", 0.1)
    paths.keep(lambda way: way == "cable")
    assert list(paths.vehicles()) == [(2, 1)]
    assert not paths.accepts(beat((2, 1)), "radio", 0.2)
