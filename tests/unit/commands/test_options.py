from __future__ import annotations

import pytest

from .said import said


@pytest.mark.parametrize(
    ("name", "option", "value"),
    [
        ("run", "--rate", "nan"),
        ("run", "--rate", "inf"),
        ("run", "--rate", "x"),
        ("run", "--system", "0"),
        ("run", "--system", "1.5"),
        ("run", "--baud", "-1"),
        ("doctor", "--seconds", "0"),
        ("doctor", "--seconds", "nan"),
    ],
)
def test_invalid_numbers_are_usage_errors(
    name: str, option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        said(name, option, value)
    assert ended.value.code == 2
    assert repr(value) in capsys.readouterr().err


def test_valid_numbers_are_accepted() -> None:
    options = said("run", "--rate", "2.5", "--system", "255", "--baud", "921600")
    assert (options.rate, options.system, options.baud) == (2.5, 255, 921600)


@pytest.mark.parametrize(
    ("value", "fault"),
    [
        ("Rover-A", "is not SYSTEM=NAME; write for example 1=Rover-A, or 1.2=Arm"),
        ("0=x", "is not SYSTEM=NAME"),
        ("1.256=x", "is not SYSTEM=NAME"),
        ("1.=x", "is not SYSTEM=NAME"),
        ("1=", "a name has 1 to 40 printable characters"),
        ("1= ", "a name has 1 to 40 printable characters"),
        ("1=" + 41 * "x", "a name has 1 to 40 printable characters"),
        ("1=a\nb", "a name has 1 to 40 printable characters"),
        ("1=a\u202eb", "a name has 1 to 40 printable characters"),
    ],
)
def test_what_is_not_the_name_of_a_vehicle_is_a_usage_error(
    value: str, fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        said("run", "--name", value)
    assert fault in capsys.readouterr().err
