"""`python -m mav_robot_status` is the command `mav-robot-status`."""

import sys

from .cli import main

sys.exit(main())
