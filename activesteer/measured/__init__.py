"""Measured data: files of other programs as recordings, compared with simulations, driven again, and fitted to."""
