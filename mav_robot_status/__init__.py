"""RobotStatus of MAVLink vehicles: can it move, who is in charge of it, and if it cannot move, why?

The public parts: `interface` (handles and statuses), `controller`, `hardware.robot_hw` (MAVLink as a hardware
interface) and `testing` (a fake autopilot). The status informs; it is no safety function.
"""

__version__ = "0.1.0"
