"""What is shown to a person of the statuses: a flight as a picture. Knows the interface's values, and no MAVLink."""
