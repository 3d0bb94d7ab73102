"""A YAML file as a tree of values with their places in it. The only module that imports YAML.

Bounded for any file: size, depth and number of values are limited. Aliases are refused, because they can expand a
short file to gigabytes.
"""

from __future__ import annotations

import os
from stat import S_ISDIR, S_ISFIFO, S_ISREG
from typing import Final, NamedTuple, NoReturn

import yaml

from ..errors import ConfigError

MAX_BYTES: Final = 1_000_000
MAX_DEPTH: Final = 20
MAX_VALUES: Final = 20_000
"""Keys and values of a file: PyYAML needs about a kilobyte and 20 us for each."""
MAX_NUMBER: Final = 64
"""Characters of a number. The time to read one grows with the square of its length."""

OPEN: Final = ("/dev/stdin", "/dev/fd/", "/proc/self/fd/")
"""The paths of what a shell has opened for us, as in `check-config <(command)`."""

_TAG: Final = "tag:yaml.org,2002:"
_CONSTRUCTED: Final = {_TAG + name for name in ("null", "bool", "int", "float")}
_KNOWN_TAGS: Final = _CONSTRUCTED | {_TAG + name for name in ("map", "seq", "str", "timestamp", "merge", "value")}
_HINTS: Final = {
    "'\\t'": "indent with spaces, not with tabs",
    "mapping values are not allowed": "check the indentation, and quote a text that contains ': '",
    "expected <block end>": "check the indentation of this line",
    "found another document": "write one document per file: remove the line '---'",
    "could not find expected ':'": "write 'key: value'",
    "expected ',' or": "close the bracket",
    "undefined alias": "quote a text that starts with '*'",
    "while scanning a quoted scalar": "close the quote",
}


class Node(NamedTuple):
    """One value of the file."""

    value: bool | int | float | str | list[Node] | dict[str, Node] | None
    text: str
    """A scalar as it was written, without quotes; empty for lists and mappings."""
    name: str
    """Its name in messages: its key, or `links[0]`."""
    at: str
    """`file:line:column`, both from 1."""
    key: Node | None = None
    """In a mapping: the key, as a value of its own."""

    def fault(self, text: str) -> ConfigError:
        """The error to raise for this value."""
        return ConfigError(f"{self.at}: {text}")

    def key_fault(self, text: str) -> ConfigError:
        """The error to raise for this value's key."""
        return (self.key or self).fault(text)

    def plain(self) -> object:
        """The value without places. Keys of mappings are strings, as in JSON."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        return [node.plain() for node in self.value] if isinstance(self.value, list) else self.value

    def shown(self) -> str:
        """The value for a message, cut to about 40 characters."""
        if isinstance(self.value, dict | list):
            return "a mapping" if isinstance(self.value, dict) else "a list"
        if isinstance(self.value, str):
            return quoted(self.value)
        return short(self.text) if self.text else "empty"


def short(text: str, limit: int = 40) -> str:
    """At most `limit` characters of a text, on one line."""
    cut = text if len(text) <= limit else text[: limit - 3] + "..."
    return "".join(c if c.isprintable() else "?" for c in cut)


def quoted(text: str) -> str:
    """A user's text for a message: short and in quotes."""
    return f"'{short(text)}'"


def load_document(path: str | os.PathLike[str]) -> Node:
    """The one document of a file; an empty file is an empty mapping. Raises ConfigError."""
    name = os.fspath(path)
    try:
        mode = os.stat(path).st_mode
        if not (S_ISREG(mode) or S_ISDIR(mode) or name.startswith(OPEN)):  # it may hold nothing, and never end
            what = "a pipe" if S_ISFIFO(mode) else "a device"
            raise ConfigError(f"{name}: this is {what}: a configuration is a file, or /dev/stdin")
        with open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ConfigError(f"{name}: cannot read the configuration: {error.strerror or error}") from None
    if len(data) > MAX_BYTES:
        raise ConfigError(f"{name}:1:1: larger than {MAX_BYTES} bytes: this is not a configuration file")
    try:
        return parse_document(data.decode("utf-8-sig"), name)
    except UnicodeDecodeError as error:
        # `error.start` is a position in `error.object`, which does not include the byte order mark
        place = _place(name, error.object[: error.start].decode("utf-8", "replace"))
        raise ConfigError(f"{place}: not UTF-8 text: save the file as UTF-8") from None


def parse_document(text: str, name: str) -> Node:
    """The document in a text. `name` is the file name for messages. Raises ConfigError."""
    try:
        loader = _Loader(text)
    except yaml.reader.ReaderError as error:
        place = _place(name, text[: error.position])
        raise ConfigError(f"{place}: a control character: remove it") from None
    try:
        root = loader.get_single_node()
        if root is None:
            return Node({}, "", "the configuration", f"{name}:1:1")
        return _Builder(loader, name).node(root, "the configuration")
    except yaml.MarkedYAMLError as error:
        raise ConfigError(_explained(error, name)) from None
    except (ValueError, OverflowError):
        # PyYAML does not catch the escape of an invalid character
        raise ConfigError(f"{_mark(name, loader.get_mark())}: not YAML: no such character or number") from None
    finally:
        loader.dispose()


class _Loader(yaml.SafeLoader):
    """PyYAML's loader with limits, without aliases."""

    depth = 0
    values = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        self.depth += 1
        self.values += 1
        if self.check_event(yaml.AliasEvent):
            self._refuse("aliases (*name) are not allowed here: write the value out")
        if self.depth > MAX_DEPTH:
            self._refuse(f"nested more than {MAX_DEPTH} deep: this is not a configuration file")
        if self.values > MAX_VALUES:
            self._refuse(f"more than {MAX_VALUES} values: this is not a configuration file")
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def _refuse(self, problem: str) -> NoReturn:
        mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


class _Builder:
    """Converts PyYAML's nodes to ours."""

    def __init__(self, loader: _Loader, file: str) -> None:
        self._loader = loader
        self._file = file

    def node(self, node: yaml.Node, name: str, key: Node | None = None) -> Node:
        """Convert one node and its children."""
        at = _mark(self._file, node.start_mark)
        if node.tag not in _KNOWN_TAGS:
            raise ConfigError(f"{at}: the tag {quoted(node.tag.replace(_TAG, '!!'))} means nothing here: remove it")
        if isinstance(node, yaml.MappingNode):
            return Node(self._mapping(node), "", name, at, key)
        if isinstance(node, yaml.SequenceNode):
            items = [self.node(item, f"{name}[{i}]") for i, item in enumerate(node.value)]
            return Node(items, "", name, at, key)
        return Node(self._scalar(node, at), node.value, name, at, key)

    def _mapping(self, node: yaml.MappingNode) -> dict[str, Node]:
        entries: dict[str, Node] = {}
        for key_node, value_node in node.value:
            key = self.node(key_node, "the key")
            if isinstance(key.value, dict | list):
                raise key.fault(f"a key must be a word, not {key.shown()}")
            if (first := entries.get(key.text)) is not None:
                place = first.key.at.removeprefix(f"{self._file}:") if first.key else ""
                raise key.fault(f"the key {quoted(key.text)} is given twice, first at {place}: remove one")
            entries[key.text] = self.node(value_node, short(key.text), key)
        return entries

    def _scalar(self, node: yaml.Node, at: str) -> bool | int | float | str | None:
        text: str = node.value
        if any("\ud800" <= c <= "\udfff" for c in text):
            raise ConfigError(f"{at}: half a surrogate pair is not a character: write the character itself")
        if node.tag not in _CONSTRUCTED:
            return text
        if len(text) > MAX_NUMBER:
            raise ConfigError(f"{at}: {quoted(text)} is too long for a number: quote it if it is a text")
        try:
            value: bool | int | float | None = self._loader.construct_object(node)
        except (ValueError, LookupError, OverflowError):
            kind = node.tag.removeprefix(_TAG)
            raise ConfigError(f"{at}: {quoted(text)} does not read as {kind}: quote it if it is a text") from None
        return value


def _mark(file: str, mark: yaml.Mark | None) -> str:
    return f"{file}:{mark.line + 1}:{mark.column + 1}" if mark is not None else f"{file}:1:1"


def _place(file: str, before: str) -> str:
    """The place at the end of a text."""
    lines = before.split("\n")
    return f"{file}:{len(lines)}:{len(lines[-1]) + 1}"


def _explained(error: yaml.MarkedYAMLError, file: str) -> str:
    """PyYAML's error as one line, with a hint for known errors."""
    # PyYAML quotes texts of any length
    said = ", ".join(short(part, 120) for part in (error.context, error.problem) if part)
    hint = next((hint for sign, hint in _HINTS.items() if sign in said), None)
    return f"{_mark(file, error.problem_mark or error.context_mark)}: {said}" + (f": {hint}" if hint else "")
