"""ArduPilot's texts. Strings checked in 4.7-dev and 4.5.6, with older wordings where real logs hold them."""

from __future__ import annotations

from typing import Final

from . import Effect, table

CAUSE, CLEAR, IGNORE, READINESS = Effect.CAUSE, Effect.CLEAR, Effect.IGNORE, Effect.READINESS

RULES: Final = table(
    [
        # what clears comes first: these texts contain the words of what they clear
        (r"Radio Failsafe Cleared", CLEAR, (2001,)),
        (r"GCS Failsafe Cleared", CLEAR, (2002,)),
        (r"EKF [Ff]ailsafe [Cc]leared", CLEAR, (2005,)),
        (r"Battery Failsafe Cleared", CLEAR, (2003, 2004)),
        (r"Terrain Failsafe Cleared", CLEAR, (2006,)),
        (r".*Failsafe Cleared", CLEAR, (2001, 2002)),
        (r"Short Failsafe Cleared|RC Long Failsafe Cleared|Throttle failsafe off", CLEAR, (2001, 2002)),
        (r"GCS Failsafe Off", CLEAR, (2002,)),
        (r"Failsafe\. (Short|Long) event off", CLEAR, (2001, 2002)),
        (r"(GPS )?Glitch cleared", CLEAR, (2008,)),
        (r"Dead Reckoning (stopped|timeout)", CLEAR, (2008,)),
        (r"Fence breach cleared", CLEAR, (2009,)),
        (r"Aborting termination", CLEAR, (1002,)),
        (r"Vibration compensation (ON|OFF)|EKF primary changed:", IGNORE),
        # emergency stop
        (r".*Emergency Stopped", Effect.ESTOP),
        (r"RC\d+: MotorEStop HIGH", Effect.ESTOP),
        (r"RC\d+: MotorEStop LOW", Effect.RELEASE),
        # arming checks: "PreArm: Internal errors" is a fault, everything else only says why it is not ready
        (r"PreArm: Internal errors 0x", CAUSE, (5001,)),
        (r"PreArm: |Arm: ", READINESS),
        # crash and damage
        (r"Crash: Disarming|Crash: Going to HOLD|Crash detected", CAUSE, (4001,)),
        (r"Hard landing detected", CAUSE, (4002,)),
        (r"Potential Thrust Loss \(", CAUSE, (4003,)),
        (r"Yaw Imbalance ", CAUSE, (4005,)),
        (r"Parachute: Released again", IGNORE),
        (r"Parachute: Released", CAUSE, (4004,)),
        (r"Terminating due to ", CAUSE, (1002,)),
        # failsafes
        (r".*Radio \+ Battery Failsafe", CAUSE, (2001,)),
        (r"Radio Failsafe|RC Failsafe|RC (Short|Long) Failsafe|Throttle failsafe on", CAUSE, (2001,)),
        (r"Failsafe\. (Short|Long) event on|Lost manual control", CAUSE, (2001,)),
        (r"GCS Failsafe|MYGCS: .*heartbeat lost", CAUSE, (2002,)),
        (r"Battery \d+ is low ", CAUSE, (2003,)),
        (r"Battery \d+ is critical ", CAUSE, (2004,)),
        (r"Battery Failsafe|Low Battery!|Low battery", CAUSE, (2003,)),
        (r"EKF Failsafe|EKF failsafe|EKF variance|EKF bad", CAUSE, (2005,)),
        (r"Failsafe: Terrain data missing|Failsafe terrain triggered", CAUSE, (2006,)),
        (r".*GPS Glitch|Dead Reckoning started", CAUSE, (2008,)),
        (r"(?i).*fence(s)? breached", CAUSE, (2009,)),
        (r"Leak Detected", CAUSE, (2010,)),
        (r"Internal pressure critical!", CAUSE, (2011,)),
        (r"Internal temperature critical!", CAUSE, (2012,)),
        (r"Depth sensor error!", CAUSE, (2013,)),
        # the autopilot itself
        (r"Internal Errors 0x", CAUSE, (5001,)),
        (r"Config Error: ", CAUSE, (5002,)),
        (r"WDG: T", CAUSE, (5003,)),
        # chatter
        (r"(Disa|A)rming motors|Throttle (dis)?armed", IGNORE),
        (r"Flight mode change failed|No such mode|Mode change to ", IGNORE),
    ]
)
