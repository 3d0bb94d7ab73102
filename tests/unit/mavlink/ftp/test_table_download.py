from __future__ import annotations

import lzma

import pytest

from mav_robot_status.mavlink.ftp.download import Failure
from mav_robot_status.mavlink.ftp.table_download import TableDownload
from mav_robot_status.testing.event_table import GENERAL, PATH, VehicleFiles, event_files
from mav_robot_status.testing.file_server import FileServer
from mav_robot_status.testing.lossy import Lossy

from .server import play


def fetched(files: VehicleFiles, lossy: Lossy | None = None, rate: float = 20_000.0) -> bytes | Failure | None:
    machine = TableDownload(files.uri, files.crc, 1, rate=rate, now=0.0)
    play(machine, FileServer(files.files), lossy)
    return machine.outcome


@pytest.mark.parametrize("rate", [1000.0, 20_000.0])
def test_the_table_arrives(rate: float) -> None:
    files = event_files()
    assert fetched(files, rate=rate) == files.files[PATH]
    assert fetched(files._replace(crc=0), rate=rate) == files.files[PATH]
    assert fetched(event_files(uri=f"mftp://[;comp=1]{GENERAL}"), rate=rate) == files.files[PATH]


def test_the_table_arrives_over_a_bad_link() -> None:
    files = event_files()
    found = [fetched(files, Lossy(0.15, 0.1, 0.2, seed)) for seed in range(20)]
    assert sum(one == files.files[PATH] for one in found) >= 18
    assert all(isinstance(one, Failure) or one == files.files[PATH] for one in found)


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        (event_files()._replace(files={}), "component_general.json.xz: OpenFileRO was refused: FileNotFound"),
        (event_files()._replace(crc=1), "component_general.json.xz: its checksum is wrong"),
        (event_files(address="https://a.b/c"), "https://a.b/c, which is not followed"),
        (event_files(uri="https://a.b/c"), "https://a.b/c, which is not followed"),
        (event_files(uri=""), "not one of MAVLink FTP"),
        (event_files(uri=f"mftp://[;comp=100]{GENERAL}"), "component 100"),
        (event_files(address="mftp://etc/other"), "etc/other: OpenFileRO was refused: FileNotFound"),
        (event_files(b""), "its size is 0 bytes"),
        (event_files(bytes(1024 * 1024 + 1)), "its size is 1048577 bytes"),
    ],
)
def test_why_there_is_no_table(files: VehicleFiles, reason: str) -> None:
    outcome = fetched(files)
    assert isinstance(outcome, Failure)
    assert reason in outcome.reason


def test_a_table_with_another_checksum_than_the_general_file_says_is_refused() -> None:
    files = event_files()
    outcome = fetched(files._replace(files={**files.files, PATH: lzma.compress(b"{}")}))
    assert outcome == Failure(f"{PATH}: its checksum is wrong")
