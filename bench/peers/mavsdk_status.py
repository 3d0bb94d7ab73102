"""UDP to JSON lines with MAVSDK for Python 4: what a status is made of, subscribed. Argument: PORT."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.telemetry import Telemetry


def main() -> None:
    """Go on until stopped."""
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER))
    mavsdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
    while (system := mavsdk.first_autopilot(1.0)) is None:
        pass
    telemetry = Telemetry(system)
    status: dict[str, Any] = {}

    def keep(name: str) -> Any:
        return lambda value, *_: status.__setitem__(name, str(value))

    telemetry.subscribe_armed(keep("armed"))
    telemetry.subscribe_flight_mode(keep("mode"))
    telemetry.subscribe_health_all_ok(keep("healthy"))
    telemetry.subscribe_in_air(keep("in_air"))
    telemetry.subscribe_status_text(keep("text"))
    while True:
        print(json.dumps({"stamp": time.time(), **status}), flush=True)
        time.sleep(0.1)


if __name__ == "__main__":
    main()
