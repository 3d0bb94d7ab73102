"""The options of a publisher: one declaration for the configuration, the command line, the checks and the reference.

Each publisher has a frozen dataclass, for example::

    @dataclass(frozen=True)
    class LampOptions(Options):
        file: Annotated[str, Option("the file that says red or green", metavar="FILE")]
        period: Annotated[float, Option("seconds between two checks", low=0.1, high=60)] = 1.0

The publisher class names it (`options_type = LampOptions`) and reads it (`LampOptions.read("lamp", context.options)`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from ..errors import UsageError

O = TypeVar("O", bound="Options")  # noqa: E741


class Option(NamedTuple):
    """What a field declares besides its name, type and default."""

    help: str
    """One line, as `--help` shows it."""
    flag: str | None = None
    """The argument of the command line, `--http`; None: this option is in configurations only."""
    metavar: str | None = None
    choices: tuple[str, ...] = ()
    low: float = -math.inf
    high: float = math.inf


class Declared(NamedTuple):
    """One option with the name, the type and the default of its field."""

    name: str
    kind: type
    """bool, float, str, or tuple for one or more texts."""
    default: object
    """dataclasses.MISSING for an option that must be given."""
    option: Option


@dataclass(frozen=True)
class Options:
    """The base of all options. Used directly: a publisher without options."""

    @classmethod
    def declared(cls) -> tuple[Declared, ...]:
        """Every option, in the order of the fields."""
        hints = get_type_hints(cls, include_extras=True)
        return tuple(_declared(field, hints[field.name]) for field in dataclasses.fields(cls))

    @classmethod
    def read(cls: type[O], publisher: str, given: Mapping[str, object]) -> O:
        """The options of a publisher's mapping in the configuration.

        A number may be given as a text, and a text as a number. None means the default. Raises UsageError, which
        names the publisher and the option, for an unknown option, a missing one, and a value of the wrong type.
        """
        declared = {one.name: one for one in cls.declared()}
        for name in given:
            if name not in declared:
                raise UsageError(f"{publisher}: unknown option {short(name)}; {_known(name, declared)}")
        values: dict[str, Any] = {
            name: _value(f"{publisher}: {name}", declared[name], value)
            for name, value in given.items()
            if value is not None
        }
        for one in declared.values():
            if one.name not in values and one.default is dataclasses.MISSING:
                raise UsageError(f"{publisher}: the option '{one.name}' is missing: {one.option.help}")
        return cls(**values)


def short(value: object, most: int = 60) -> str:
    """A user's value for a message: in quotes if it is a text, and cut to `most` characters."""
    shown = repr(value)
    return shown if len(shown) <= most else f"{shown[: most - 4]}...{shown[-1]}"


def _declared(field: dataclasses.Field[Any], hint: Any) -> Declared:
    if get_origin(hint) is not Annotated:
        raise TypeError(f"{field.name}: write Annotated[TYPE, Option(...)]")
    annotated, option = get_args(hint)
    kind = get_origin(annotated) or annotated
    if kind not in (bool, float, str, tuple):  # `str | None`: None if not given
        kind = next(member for member in get_args(annotated) if member is not type(None))
    return Declared(field.name, kind, field.default, option)


def _known(name: str, declared: Iterable[str]) -> str:
    import difflib  # only for this message

    names = list(declared)
    near = difflib.get_close_matches(name, names, 1)
    if near:
        return f"did you mean '{near[0]}'?"
    return f"the options are {', '.join(names)}" if names else "there are none"


def _value(what: str, declared: Declared, value: object) -> object:
    if declared.kind is bool:
        if isinstance(value, bool):
            return value
        raise UsageError(f"{what}: must be true or false, not {short(value)}")
    if declared.kind is float:
        return _number(what, declared.option, value)
    if declared.kind is tuple and isinstance(value, list | tuple):
        return tuple(_text(what, item) for item in value)
    text = _text(what, value)
    if declared.option.choices and text not in declared.option.choices:
        raise UsageError(f"{what}: must be one of {', '.join(declared.option.choices)}, not {short(text)}")
    return (text,) if declared.kind is tuple else text


def _text(what: str, value: object) -> str:
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        return str(value)
    raise UsageError(f"{what}: must be a text, not {short(value)}")


def _number(what: str, option: Option, value: object) -> float:
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
        if option.low <= number <= option.high and math.isfinite(number):
            return number
    bounds = f" from {option.low:g} to {option.high:g}" if math.isfinite(option.low + option.high) else ""
    raise UsageError(f"{what}: must be a number{bounds}, not {short(value)}")
