"""PX4's texts. Strings of 1.17-alpha, src/modules/commander; the TAB that ends them is stripped before matching."""

from __future__ import annotations

from typing import Final

from . import Effect, When, table

CAUSE, CLEAR, DETAIL, IGNORE, READINESS = Effect.CAUSE, Effect.CLEAR, Effect.DETAIL, Effect.IGNORE, Effect.READINESS

RULES: Final = table(
    [
        (
            r"GCS connection regained|Connection to (ground station|mission computer) (regained|restored)",
            CLEAR,
            (2002,),
        ),
        # up to 1.11 the words are all there is: no state FLIGHT_TERMINATION
        (r"(?i)(manual )?kill-switch engaged", Effect.ESTOP),
        (r"(?i)(manual )?kill-switch disengaged", Effect.RELEASE),
        (r"Kill (dis)?engaged|Failsafe activated", DETAIL),
        (r"Connection to mission computer lost", CAUSE, (2002,)),
        (r"Connection to ground station lost", CAUSE, (2002,), When.CRITICAL),
        (r"Preflight Fail: (Kill switch engaged|Flight termination active)", DETAIL),
        (r"Preflight Fail: (Attitude failure \((roll|pitch)\)|.*Altitude failure)", CAUSE, (4006,), When.IN_TROUBLE),
        (r"Preflight Fail: .*(Motor|ESC) failure detected", CAUSE, (4003,), When.IN_TROUBLE),
        (r"Preflight Fail: .*Imbalanced propeller detected", CAUSE, (4005,), When.IN_TROUBLE),
        (r"Preflight Fail: ", READINESS),
        # answers to an operator, never an error
        (
            r"Arming denied: |Disarming denied: |Switching to .* is currently not available|Unsupported auto mode",
            READINESS,
        ),
        # severity 2 in older versions, and no more than a word on what was asked for
        (r".* not possible|Using minimum takeoff altitude|Already (higher than takeoff altitude|landed)", IGNORE),
        (r"([Rr]everse )?[Mm]ission finished|offboard mission now running|no valid mission available", IGNORE),
        (r"Low battery", CAUSE, (2003,), When.ARMED),
        (r"Critical battery|Emergency battery level|Dangerously low battery!", CAUSE, (2004,), When.ARMED),
        (r"Battery \d+ disconnected|Battery \d+: .*\. ", CAUSE, (2004,), When.ARMED),
        (r"ESC\d+: .*\. |.*offline\. Land now!", CAUSE, (4003,), When.ARMED),
        (r"Compass needs calibration - Land now!|GPS jamming detected", CAUSE, (6002,), When.ARMED),
        (r"Maximum flight time reached|Parachute system lost", CAUSE, (6002,), When.ARMED),
    ]
)
