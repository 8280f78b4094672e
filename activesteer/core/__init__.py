"""Common parts of all packages: conventions, units, messages, files and their limits, the table of metrics.

In: nothing of the other packages.
Out: types, functions and tables without state.
"""
