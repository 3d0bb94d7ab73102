"""Why motion is not possible, and why the vehicle cannot be armed."""
