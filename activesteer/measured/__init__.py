"""Measured data: import as recordings, comparison with simulations, repeated drives, and fits of parameters.

In: measured tables of any tool.
Out: recordings, comparisons, and fitted parameters with intervals.
"""
