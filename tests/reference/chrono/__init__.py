"""Comparison of the sedan with the same car in Project Chrono; see `tools/validate.py`."""
