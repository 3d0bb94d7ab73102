"""UDP to JSON lines with MAVSDK for Python 4, which subscribes to the inputs of a status. Argument: PORT."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.telemetry import Telemetry


def main() -> None:
    """Run until stopped."""
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER))
    mavsdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
    while (system := mavsdk.first_autopilot(1.0)) is None:
        pass
    telemetry = Telemetry(system)
    status: dict[str, Any] = {}

    def store(name: str) -> Any:
        return lambda value, *_: status.__setitem__(name, str(value))

    telemetry.subscribe_armed(store("armed"))
    telemetry.subscribe_flight_mode(store("mode"))
    telemetry.subscribe_health_all_ok(store("healthy"))
    telemetry.subscribe_in_air(store("in_air"))
    telemetry.subscribe_status_text(store("text"))
    while True:
        print(json.dumps({"stamp": time.time(), **status}), flush=True)
        time.sleep(0.1)


if __name__ == "__main__":
    main()
