"""The files of signing: the key file of the user and the timestamp that survives a restart."""

from __future__ import annotations

import itertools
import logging
import os
import threading
from hashlib import sha256
from pathlib import Path

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.links.signing_keys import RESERVE, HeardStore, StampStore, read_key, stamp_path
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.signing import MAX_STAMP, MAX_STREAMS, UNITS_PER_SECOND, Signer, stamp_at

SECRET = "c0ffee" + "0123456789ABCDEFabcdef0123456789" + "42" * 13
NOW = 1_795_200_547_123_456  # us since 1970
SECOND = 1_000_000  # us
STAMP = stamp_at(NOW)
FRAME = encode(Heartbeat(4, 2, 3, 209, 4, 3), system=1, component=192, sequence=0)


# the key


def key_file(folder: Path, data: str | bytes, mode: int = 0o600) -> Path:
    path = folder / "vehicle.key"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    path.chmod(mode)
    return path


@pytest.mark.parametrize("text", [SECRET, SECRET + "\n", SECRET.upper() + "\r\n", f"\ufeff {SECRET} \n\n"])
def test_64_hexadecimal_digits_are_the_key(tmp_path: Path, text: str) -> None:
    assert read_key(key_file(tmp_path, text)) == bytes.fromhex(SECRET)


@pytest.mark.parametrize(
    "text", ["passphrase: köln am rhein", "passphrase:köln am rhein\n", "passphrase:  köln am rhein \r\n"]
)
def test_the_key_of_a_passphrase_is_its_hash(tmp_path: Path, text: str) -> None:
    assert read_key(key_file(tmp_path, text)) == sha256("köln am rhein".encode()).digest()


def test_64_digits_after_the_passphrase_prefix_are_a_passphrase(tmp_path: Path) -> None:
    assert read_key(key_file(tmp_path, f"passphrase: {SECRET}")) == sha256(SECRET.encode()).digest()


def test_a_home_folder_may_be_written_as_a_tilde(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key_file(tmp_path, SECRET)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert read_key("~/vehicle.key") == bytes.fromhex(SECRET)


@pytest.mark.parametrize(
    ("data", "what"),
    [
        ("", "the signing key is empty: write one line, 64 hexadecimal digits or 'passphrase: ...'"),
        (" \n\n", "the signing key is empty: write"),
        (SECRET[:-1], "this is not a signing key: write"),
        (SECRET + "0", "this is not a signing key: write"),
        (SECRET[:-1] + "g", "this is not a signing key: write"),
        (SECRET[:-1] + "٣", "this is not a signing key: write"),
        (SECRET + "\n" + SECRET, "this is not a signing key: write"),
        ("passphrase:", "this is not a signing key: write"),
        ("passphrase: \n", "this is not a signing key: write"),
        ("passphrase: c0ffee\nc0ffee", "this is not a signing key: write"),
        ("passphrase: c0ffee\0", "this is not a signing key: write"),
        ("passphrase: " + "c0ffee" * 1000, "this is not a signing key: write"),
        ("c0ffee in the morning", "this is not a signing key: write"),
        (bytes(range(128, 160)), "the signing key is not UTF-8 text: write"),
        ("0" * 64, "a signing key of zeros means 'unsigned' in MAVLink: choose another"),
    ],
)
def test_a_malformed_key_file_is_refused_and_its_content_is_not_shown(
    tmp_path: Path, data: str | bytes, what: str
) -> None:
    path = key_file(tmp_path, data)
    with pytest.raises(UsageError) as caught:
        read_key(path)
    assert str(caught.value).startswith(f"{path}: {what}")
    assert "\n" not in str(caught.value)
    assert "c0ffee" not in str(caught.value)


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o644, 0o666, 0o777])
def test_a_key_file_that_others_can_read_or_change_is_refused(tmp_path: Path, mode: int) -> None:
    path = key_file(tmp_path, SECRET, mode)
    with pytest.raises(UsageError) as caught:
        read_key(path)
    assert str(caught.value).endswith(f"can read or change this signing key: chmod 600 {path}")


def test_a_key_file_that_is_read_only_for_its_owner_is_accepted(tmp_path: Path) -> None:
    assert read_key(key_file(tmp_path, SECRET, 0o400)) == bytes.fromhex(SECRET)


def test_the_permissions_of_a_symlink_target_are_checked(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(key_file(tmp_path, SECRET, 0o644))
    with pytest.raises(UsageError, match="chmod 600"):
        read_key(link)


@pytest.mark.parametrize(("name", "why"), [("no", "No such file"), ("", "Is a directory"), ("a\0b", "embedded null")])
def test_the_error_names_an_unreadable_file(tmp_path: Path, name: str, why: str) -> None:
    with pytest.raises(UsageError, match=f"cannot read the signing key: {why}"):
        read_key(os.path.join(tmp_path, name))


# the path of the timestamp


def test_the_state_directory_is_that_of_systemd_or_else_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", "/var/lib/one:/var/lib/two")
    monkeypatch.setenv("XDG_STATE_HOME", "/state")
    monkeypatch.setenv("HOME", "/home/me")
    folders = [stamp_path(bytes(32)).parent]
    monkeypatch.delenv("STATE_DIRECTORY")
    folders.append(stamp_path(bytes(32)).parent)
    monkeypatch.setenv("XDG_STATE_HOME", "relative")
    folders.append(stamp_path(bytes(32)).parent)
    monkeypatch.delenv("XDG_STATE_HOME")
    folders.append(stamp_path(bytes(32)).parent)
    monkeypatch.setenv("HOME", "relative")
    folders.append(stamp_path(bytes(32)).parent)
    assert [str(folder) for folder in folders] == [
        "/var/lib/one",
        "/state/mav-robot-status",
        "/home/me/.local/state/mav-robot-status",
        "/home/me/.local/state/mav-robot-status",
        "/relative/.local/state/mav-robot-status",
    ]


def test_each_key_has_its_own_file_and_the_name_does_not_reveal_the_key() -> None:
    key = bytes.fromhex(SECRET)
    name = stamp_path(key).name
    assert name == stamp_path(key).name != stamp_path(bytes(32)).name
    assert name.removesuffix(".stamp") not in key.hex() + sha256(key).hexdigest()


# the timestamp


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "a.stamp"


def on_disk(path: Path) -> int:
    return int(path.read_bytes())


def test_the_first_start_uses_the_clock_and_reserves_timestamps(path: Path) -> None:
    assert StampStore(path).start(NOW) == STAMP
    assert on_disk(path) == STAMP + RESERVE


def test_file_and_directory_are_private_to_the_user(path: Path) -> None:
    StampStore(path).start(NOW)
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    assert os.listdir(path.parent) == ["a.stamp"]


def run(path: Path, at: int, seconds: int) -> list[int]:
    """The timestamps of one run of the gateway, up to a crash."""
    store = StampStore(path)
    signer = Signer(bytes.fromhex(SECRET), 192, store.start(at))
    stamps = []
    for second in range(seconds):
        signer.sign(FRAME, at + second * SECOND)
        stamps.append(signer.stamp)
        store.keep(signer.stamp)
        store.settle()  # one second is enough for a disk
        assert signer.stamp <= on_disk(path)
    return stamps


def test_timestamps_increase_across_crashes_and_backward_clock_steps(path: Path) -> None:
    stamps = [0]
    for at, seconds in ((NOW, 100), (NOW + 100 * SECOND, 5), (NOW, 70), (0, 3), (NOW - 86400 * SECOND, 100)):
        stamps += run(path, at, seconds)
    assert all(later > earlier for earlier, later in itertools.pairwise(stamps))


def test_the_timestamp_is_written_every_30_seconds(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    run(path, NOW, 600)
    assert 19 <= len(synced) <= 21


def test_an_unchanged_timestamp_is_not_written_again(path: Path) -> None:
    store = StampStore(path)
    stamp = store.start(NOW)
    path.unlink()
    for _ in range(1000):
        store.keep(stamp)
    store.settle()
    assert not path.exists()


def test_a_timestamp_that_jumps_is_written_soon(path: Path) -> None:
    store = StampStore(path)
    store.start(NOW)
    store.keep(STAMP + 10**9)
    store.settle()
    assert on_disk(path) == STAMP + 10**9 + RESERVE


def test_no_timestamps_are_skipped_after_a_clean_shutdown(path: Path) -> None:
    store = StampStore(path)
    store.start(NOW)
    store.keep(STAMP + RESERVE)
    store.close(STAMP + RESERVE + 7)
    assert on_disk(path) == STAMP + RESERVE + 7
    assert StampStore(path).start(0) == STAMP + RESERVE + 7


def test_the_event_loop_does_not_wait_for_the_disk(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = StampStore(path)
    store.start(NOW)
    stuck, freed, calls = threading.Event(), threading.Event(), []

    def fsync(descriptor: int) -> None:
        calls.append(descriptor)
        stuck.set()
        assert freed.wait(10)

    monkeypatch.setattr(os, "fsync", fsync)
    for second in range(1000):  # with a second write this would wait for ten seconds
        store.keep(STAMP + RESERVE * (1 + second))
        assert stuck.wait(10)
    assert len(calls) == 1
    assert on_disk(path) == STAMP + RESERVE
    freed.set()
    assert store.settle()
    store.keep(STAMP + RESERVE * 1000)
    store.settle()
    assert on_disk(path) == STAMP + RESERVE * 1001


def test_a_hanging_disk_does_not_delay_shutdown(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mav_robot_status.gateway.links.state_file.PATIENCE", 0.01)
    store = StampStore(path)
    store.start(NOW)
    freed = threading.Event()
    monkeypatch.setattr(os, "fsync", lambda _: freed.wait(10))
    store.keep(STAMP + RESERVE)
    store.close(STAMP + RESERVE)
    assert on_disk(path) == STAMP + RESERVE
    freed.set()
    monkeypatch.setattr("mav_robot_status.gateway.links.state_file.PATIENCE", 10.0)
    assert store.settle()


def test_an_unwritable_directory_is_logged_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").touch()
    store = StampStore(tmp_path / "file" / "a.stamp")
    assert store.start(NOW) == STAMP
    for second in range(100):
        store.keep(STAMP + second * UNITS_PER_SECOND)
    store.close(STAMP + 10_000_000)
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path}/file/a.stamp: cannot read the signing time stamp: Not a directory; "
        "signing continues with the clock alone"
    ]


def test_a_failed_write_leaves_no_file_behind(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    store = StampStore(path)
    stamp = store.start(NOW)
    path.unlink()
    (path / "in the way").mkdir(parents=True)
    for second in range(100):
        store.keep(stamp + second * UNITS_PER_SECOND)
        store.settle()
    assert os.listdir(path.parent) == ["a.stamp"]
    assert [record.getMessage() for record in caplog.records] == [
        f"{path}: cannot write the signing time stamp: Is a directory; signing continues with the clock alone"
    ]


@pytest.mark.parametrize("data", [b"", b"\n", b"-5", b"12x", b"9" * 15, b"9" * 100, b"\xff\xfe", "٣".encode()])
def test_a_damaged_file_is_logged_and_rewritten(path: Path, data: bytes, caplog: pytest.LogCaptureFixture) -> None:
    path.parent.mkdir()
    path.write_bytes(data)
    with caplog.at_level(logging.WARNING):
        assert StampStore(path).start(NOW) == STAMP
    assert f"{path}: this is not a signing time stamp; signing continues with the clock alone" in caplog.text
    assert on_disk(path) == STAMP + RESERVE


def test_nothing_is_written_after_the_last_possible_timestamp(path: Path) -> None:
    path.parent.mkdir()
    path.write_bytes(b"%d\n" % MAX_STAMP)
    store = StampStore(path)
    assert store.start(NOW) == MAX_STAMP
    path.unlink()
    store.keep(MAX_STAMP)
    store.settle()
    assert not path.exists()


# the timestamps that were heard

HEARD = {(1, 1): STAMP, (1, 191): STAMP + 7, (255, 190): 0}


@pytest.fixture
def heard(tmp_path: Path) -> Path:
    return tmp_path / "state" / "a.heard"


def kept(path: Path, newest: dict[tuple[int, int], int]) -> None:
    """One run of the gateway."""
    store = HeardStore(path)
    store.start()
    store.close(newest)


def test_what_was_heard_survives_a_restart(heard: Path) -> None:
    kept(heard, HEARD)
    assert HeardStore(heard).start() == HEARD
    assert heard.stat().st_mode & 0o777 == 0o600


def test_before_the_first_run_nothing_was_heard(heard: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert HeardStore(heard).start() == {}
    assert not caplog.records


def test_what_was_heard_is_written_every_two_seconds_if_it_has_changed(heard: Path) -> None:
    store = HeardStore(heard)
    written = []
    for tick in range(100):  # ten seconds, and changes in the first five
        store.keep({(1, 1): min(tick, 50)}, tick / 10)
        assert store._file.settle()
        if heard.exists():
            written.append((tick, HeardStore(heard).start()[1, 1]))
            heard.unlink()
    assert written == [(0, 0), (20, 20), (40, 40), (60, 50)]


def test_the_loop_does_not_wait_for_the_write_of_what_was_heard(heard: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = HeardStore(heard)
    freed, calls, replace = threading.Event(), [], os.replace

    def hang(*paths: Path) -> None:
        calls.append(paths)
        assert freed.wait(10)
        replace(*paths)

    monkeypatch.setattr(os, "replace", hang)
    for second in range(1000):
        store.keep({(1, 1): second}, float(second))
    assert len(calls) <= 1
    freed.set()
    assert store._file.settle()
    store.close({(1, 1): 1000})
    assert HeardStore(heard).start() == {(1, 1): 1000}


def test_of_too_many_senders_those_heard_last_are_kept(heard: Path) -> None:
    kept(heard, {(number // 250, number % 250): STAMP + number for number in range(3 * MAX_STREAMS)})
    found = HeardStore(heard).start()
    assert (len(found), min(found.values())) == (MAX_STREAMS, STAMP + 2 * MAX_STREAMS)


def damaged(data: bytes) -> list[bytes]:
    """Every file with one flipped bit, and every file that ends early."""
    flipped = [data[:at] + bytes((data[at] ^ 1 << at % 8,)) + data[at + 1 :] for at in range(len(data))]
    return [*flipped, *(data[:end] for end in range(len(data)))]


def test_a_damaged_list_counts_as_none_and_is_logged_once(heard: Path, caplog: pytest.LogCaptureFixture) -> None:
    kept(heard, HEARD)
    for data in [*damaged(heard.read_bytes()), b"\xff" * 100_000, b"0 0\n1"]:
        heard.write_bytes(data)
        caplog.clear()
        store = HeardStore(heard)
        assert store.start() == store.start() == {}
        assert len(caplog.records) == 1
    assert "this is not a list of the time stamps heard; frames recorded before this start are" in caplog.text


def test_a_list_that_cannot_be_written_is_logged_once(heard: Path, caplog: pytest.LogCaptureFixture) -> None:
    (heard / "in the way").mkdir(parents=True)
    store = HeardStore(heard)
    assert store.start() == {}
    for second in range(100):
        store.keep({(1, 1): second}, float(second))
        assert store._file.settle()
    store.close({(1, 1): 100})
    assert len(caplog.records) == 1
    assert os.listdir(heard.parent) == ["a.heard"]
