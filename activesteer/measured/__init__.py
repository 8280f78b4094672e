"""Measured data: import as recordings, comparison with simulations, repeated runs, and parameter fits.

In: measured tables of any tool.
Out: recordings, comparisons, and fitted parameters with intervals.
"""
