"""A design as C for a microcontroller, with simulated walks that it must reproduce exactly."""
