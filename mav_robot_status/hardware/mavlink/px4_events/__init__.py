"""PX4's events interface: ids, arguments, and the table that gives an event its words.

An EVENT carries an id and raw arguments. The id is a hash of the event's name, so the events of the arming report and
of a failsafe are known without a table. Sources: mavlink/libevents, README and `libs/cpp/parse`; PX4, src/lib/events
and src/modules/commander (HealthAndArmingChecks, failsafe).
"""

from .ids import ARMING_SUMMARY, HEALTH_SUMMARY
from .table import EventTable

__all__ = ["ARMING_SUMMARY", "HEALTH_SUMMARY", "EventTable"]
