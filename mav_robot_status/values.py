"""`NamedTuple` and `dataclass`, as `typing` and `dataclasses` have them, made in a fraction of the time.

A process makes two hundred such classes when it starts, and the standard library compiles the source of one to six
functions for each at once. Here a class compiles its constructor at its first use, and most are never used in a run.
All other functions are shared. A class that other packages derive from, such as `Options`, uses the standard library.
"""

from __future__ import annotations

import typing
from typing import TYPE_CHECKING

__all__ = ["NamedTuple", "dataclass"]

if TYPE_CHECKING:
    from dataclasses import dataclass
    from typing import NamedTuple
else:
    import dataclasses
    from collections import _tuplegetter

    _new = tuple.__new__

    # -- named tuples

    def _construct_later(owner):
        """A constructor that replaces itself by a compiled one when it is first called."""

        def construct(cls, /, *values, **named):
            names = ", ".join(owner._fields)
            source = f"lambda _cls, {names}: _new(_cls, ({names}{',' if names else ''}))"
            made = eval(source, {"_new": _new, "__builtins__": {}})
            made.__defaults__ = tuple(owner._field_defaults.values())
            made.__name__ = "__new__"
            made.__qualname__ = f"{owner.__qualname__}.__new__"
            owner.__new__ = staticmethod(made)
            return made(cls, *values, **named)

        return staticmethod(construct)

    class _Tuple(tuple):
        """What all named tuples share."""

        __slots__ = ()
        _fields = ()
        _field_defaults = {}  # noqa: RUF012  # no instance has it

        @classmethod
        def _make(cls, values):
            """A new one from a sequence."""
            made = _new(cls, values)
            if len(made) != len(cls._fields):
                raise TypeError(f"Expected {len(cls._fields)} arguments, got {len(made)}")
            return made

        def _replace(self, /, **named):
            """A new one with other values in the named fields."""
            made = _new(type(self), map(named.pop, self._fields, self))
            if named:
                raise ValueError(f"Got unexpected field names: {list(named)!r}")
            return made

        def _asdict(self):
            """The values by the names of their fields."""
            return dict(zip(self._fields, self, strict=True))

        __replace__ = _replace

        def __repr__(self):
            values = ", ".join(f"{name}={value!r}" for name, value in zip(self._fields, self, strict=True))
            return f"{type(self).__name__}({values})"

        def __getnewargs__(self):
            return tuple(self)

    class _Meta(type):
        """Makes the class of a named tuple from its annotations."""

        def __new__(mcs, name, bases, body):
            if "__annotations__" not in body:  # a later Python may evaluate annotations on demand
                return typing.NamedTupleMeta.__new__(typing.NamedTupleMeta, name, (typing._NamedTuple,), body)
            fields = tuple(body["__annotations__"])
            defaults = {field: body[field] for field in fields if field in body}
            if tuple(defaults) != fields[len(fields) - len(defaults) :]:
                raise TypeError(f"{name}: a field without a default follows a field with one")
            for position, field in enumerate(fields):
                body[field] = _tuplegetter(position, field)
            body.update(__slots__=(), _fields=fields, __match_args__=fields, _field_defaults=defaults)
            made = type(name, (_Tuple,), body)
            made.__new__ = _construct_later(made)
            return made

    _base = type.__new__(_Meta, "NamedTuple", (), {})

    def NamedTuple():  # noqa: N802
        """The base of a named tuple: `class Point(NamedTuple): x: int`. The finished class is a tuple without it."""

    NamedTuple.__mro_entries__ = lambda bases: (_base,)

    # -- dataclasses

    def dataclass(*, frozen=False, slots=False):
        """As `dataclasses.dataclass`, with these two parameters only."""

        def finish(cls):
            made = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots)(cls)
            made.__init__ = _initialise_later(made, frozen)
            made.__repr__, made.__eq__ = _repr, _eq
            made.__hash__ = _hash if frozen else None
            if frozen:
                made.__setattr__, made.__delattr__ = _refuse_to_set, _refuse_to_delete
            return made

        return finish

    def _initialise_later(owner, frozen):
        """An `__init__` that replaces itself by a compiled one when it is first called."""

        def initialise(self, /, *values, **named):
            scope = {"_set": object.__setattr__}
            parameters, lines = [], []
            for field in dataclasses.fields(owner):
                name, value = field.name, field.name
                if field.default is not dataclasses.MISSING:
                    scope[f"_default_{name}"] = field.default
                    parameter = f"{name}=_default_{name}"
                elif field.default_factory is not dataclasses.MISSING:
                    scope[f"_make_{name}"] = field.default_factory
                    scope["_absent"] = dataclasses.MISSING
                    parameter = f"{name}=_absent"
                    value = f"_make_{name}() if {name} is _absent else {name}"
                else:
                    parameter = name
                if field.init:
                    parameters.append(parameter)
                elif parameter == name:
                    continue
                elif value == name:
                    value = f"_default_{name}"
                else:
                    value = f"_make_{name}()"
                lines.append(f"_set(self, '{name}', {value})" if frozen else f"self.{name} = {value}")
            if hasattr(owner, "__post_init__"):
                lines.append("self.__post_init__()")
            source = f"def __init__(self, {', '.join(parameters)}):\n " + "\n ".join(lines or ["pass"])
            exec(source, scope)
            made = owner.__init__ = scope["__init__"]
            made.__qualname__ = f"{owner.__qualname__}.__init__"
            made(self, *values, **named)

        return initialise

    def _compared(one):
        return tuple(getattr(one, field.name) for field in dataclasses.fields(one) if field.compare)

    def _eq(self, other):
        return _compared(self) == _compared(other) if other.__class__ is self.__class__ else NotImplemented

    def _hash(self):
        return hash(_compared(self))

    def _repr(self):
        values = (f"{field.name}={getattr(self, field.name)!r}" for field in dataclasses.fields(self) if field.repr)
        return f"{type(self).__qualname__}({', '.join(values)})"

    def _refuse_to_set(self, name, value):
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")

    def _refuse_to_delete(self, name):
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
