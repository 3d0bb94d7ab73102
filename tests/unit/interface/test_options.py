"""Options: read from a mapping, with an error that names the publisher and the option."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import pytest

from mav_robot_status.errors import UsageError
from mav_robot_status.interface import Option, Options


@dataclass(frozen=True)
class LampOptions(Options):
    """The options of a third-party publisher."""

    file: Annotated[str, Option("the file that says red or green", "--lamp", "FILE")]
    period: Annotated[float, Option("seconds between two looks", low=0.1, high=60)] = 1.0
    colour: Annotated[str | None, Option("of the lamp", choices=("red", "green"))] = None
    blink: Annotated[bool, Option("switch on and off")] = False
    rooms: Annotated[tuple[str, ...], Option("where it hangs")] = ()


@pytest.mark.parametrize(
    ("given", "options"),
    [
        ({"file": "x"}, LampOptions("x")),
        ({"file": 7, "period": "2.5"}, LampOptions("7", 2.5)),
        ({"file": "x", "period": None, "colour": None}, LampOptions("x")),
        ({"file": "x", "colour": "red", "blink": True}, LampOptions("x", colour="red", blink=True)),
        ({"file": "x", "rooms": "hall"}, LampOptions("x", rooms=("hall",))),
        ({"file": "x", "rooms": ["hall", 3]}, LampOptions("x", rooms=("hall", "3"))),
    ],
)
def test_a_mapping_is_parsed_into_options(given: dict[str, object], options: LampOptions) -> None:
    assert LampOptions.read("lamp", given) == options


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, "lamp: the option 'file' is missing: the file that says red or green"),
        ({"file": "x", "perod": 1}, "lamp: unknown option 'perod'; did you mean 'period'?"),
        ({"file": "x", "zzz": 1}, "lamp: unknown option 'zzz'; the options are file, period, colour, blink, rooms"),
        ({"file": True}, "lamp: file: must be a text, not True"),
        ({"file": ["x"]}, "lamp: file: must be a text, not ['x']"),
        ({"file": "x", "period": 61}, "lamp: period: must be a number from 0.1 to 60, not 61"),
        ({"file": "x", "period": "soon"}, "lamp: period: must be a number from 0.1 to 60, not 'soon'"),
        ({"file": "x", "period": float("nan")}, "lamp: period: must be a number from 0.1 to 60, not nan"),
        ({"file": "x", "period": True}, "lamp: period: must be a number from 0.1 to 60, not True"),
        ({"file": "x", "colour": "blue"}, "lamp: colour: must be one of red, green, not 'blue'"),
        ({"file": "x", "blink": "yes"}, "lamp: blink: must be true or false, not 'yes'"),
        ({"file": "x", "rooms": [None]}, "lamp: rooms: must be a text, not None"),
    ],
)
def test_an_invalid_option_is_an_error_that_names_it(given: dict[str, object], found: str) -> None:
    with pytest.raises(UsageError) as error:
        LampOptions.read("lamp", given)
    assert str(error.value) == found


def test_a_publisher_without_options_refuses_every_option() -> None:
    assert Options.read("plain", {}) == Options()
    with pytest.raises(UsageError, match="plain: unknown option 'x'; there are none"):
        Options.read("plain", {"x": 1})


def test_a_field_without_an_option_is_a_declaration_error() -> None:
    @dataclass(frozen=True)
    class Bare(Options):
        """A field without an option."""

        file: str = ""

    with pytest.raises(TypeError, match="file: write Annotated"):
        Bare.declared()
