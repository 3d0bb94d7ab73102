"""Arms of Universal Robots: their state by RTDE, their operational mode by the dashboard server."""
