"""Our named tuples and dataclasses behave as those of the standard library."""

from __future__ import annotations

import copy
import dataclasses
import pickle
import typing
from dataclasses import field
from typing import Any

import pytest

from mav_robot_status import values


class Ours(values.NamedTuple):
    """A point."""

    x: int
    y: float = 0.5

    def doubled(self) -> float:
        return self.y * 2


class Theirs(typing.NamedTuple):
    """A point."""

    x: int
    y: float = 0.5


def test_a_named_tuple_equals_that_of_the_standard_library() -> None:
    for made in ((1,), (1, 2.0)):
        ours, theirs = Ours(*made), Theirs(*made)
        assert tuple(ours) == tuple(theirs)
        assert repr(ours) == repr(theirs).replace("Theirs", "Ours")
        assert ours._asdict() == theirs._asdict()
        assert tuple(ours._replace(x=7)) == tuple(theirs._replace(x=7))
    for name in ("_fields", "_field_defaults", "__match_args__", "__doc__", "__slots__"):
        assert getattr(Ours, name) == getattr(Theirs, name), name
    assert Ours(x=1, y=2).y == 2
    assert Ours(1).doubled() == 1.0
    assert Ours._make((1, 2)) == (1, 2)
    assert typing.get_type_hints(Ours) == {"x": int, "y": float}


@pytest.mark.parametrize(
    "wrong",
    [
        lambda cls: cls(),
        lambda cls: cls(1, 2, 3),
        lambda cls: cls(1, z=2),
        lambda cls: cls._make((1,)),
    ],
)
def test_a_wrong_call_of_a_named_tuple_raises_as_in_the_standard_library(wrong: Any) -> None:
    errors = []
    for cls in (Ours, Theirs):
        with pytest.raises((TypeError, ValueError)) as raised:
            wrong(cls)
        errors.append((raised.type, str(raised.value).replace("Theirs", "Ours")))
    assert errors[0] == errors[1]


def test_an_unknown_field_cannot_be_replaced() -> None:
    with pytest.raises(ValueError, match="'z'"):  # TypeError in the standard library since Python 3.13
        Ours(1)._replace(z=2)  # type: ignore[call-arg]


def test_a_named_tuple_can_be_copied_and_pickled() -> None:
    assert copy.deepcopy(Ours(1)) == pickle.loads(pickle.dumps(Ours(1))) == Ours(1)
    assert type(pickle.loads(pickle.dumps(Ours(1)))) is Ours


def test_a_field_without_a_default_behind_one_is_an_error() -> None:
    with pytest.raises(TypeError, match="follows"):
        exec("class Wrong(values.NamedTuple):\n x: int = 1\n y: int", {"values": values, "__name__": __name__})


def made_by(dataclass: Any) -> tuple[Any, Any]:
    @dataclass(frozen=True, slots=True)
    class Frozen:
        """Frozen."""

        a: int
        b: dict[str, int] = field(default_factory=dict)
        where: str = field(default="", compare=False)

    @dataclass(slots=True)
    class Mutable:
        """Mutable."""

        a: int = 1
        total: int = field(init=False)
        names: list[str] = field(init=False, default_factory=list)

        def __post_init__(self) -> None:
            self.total = self.a + 1

    return Frozen, Mutable


@pytest.mark.parametrize("dataclass", [values.dataclass, dataclasses.dataclass])
def test_a_dataclass_is_that_of_the_standard_library(dataclass: Any) -> None:
    frozen, mutable = made_by(dataclass)
    one = frozen(1, where="here")
    assert one == frozen(a=1)
    assert one != frozen(2)
    assert one != (1, {}, "here")
    assert repr(one).endswith("Frozen(a=1, b={}, where='here')")
    assert one.b is not frozen(1).b
    assert dataclasses.replace(one, a=3) == frozen(3)
    assert [f.name for f in dataclasses.fields(frozen)] == ["a", "b", "where"]
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'a'"):
        one.a = 2
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'a'"):
        del one.a
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)
    assert hash(frozen(1, ())) == hash(frozen(1, (), "there"))
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'a'"):
        frozen()
    two = mutable(4)
    two.a = 5
    assert (two.a, two.total, two.names) == (5, 5, [])
    assert two.names is not mutable().names
    assert mutable.__hash__ is None
    with pytest.raises(AttributeError):
        two.other = 1
