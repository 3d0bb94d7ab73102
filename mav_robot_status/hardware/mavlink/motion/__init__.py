"""Speed, rotation and the land detector: whether the vehicle moves."""
