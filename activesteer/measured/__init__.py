"""Measured data: import as recordings, comparison with simulations, repeated drives, and fits of parameters."""
