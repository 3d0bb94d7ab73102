"""The type of a JSON object: a line, an explanation, a table. Its members are checked where they are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

JsonObject = dict[str, Any]
JsonMapping = Mapping[str, Any]
"""The same, to be read only."""
