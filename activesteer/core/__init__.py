"""Common parts of all rooms: conventions, units, messages, files and their limits, the table of metrics.

In: nothing of the other rooms.
Out: types, functions and tables without state.
"""
