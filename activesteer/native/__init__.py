"""Compiled laws on records: compilation, memory and records that Python and compiled code share.

In: laws written in Python, and messages.
Out: the same laws as native code, and views of native memory.
"""
