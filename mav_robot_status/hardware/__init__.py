"""What a robot is: hardware interfaces, which fill the handles of `interface`."""
