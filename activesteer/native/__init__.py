"""Control laws as compiled functions: compilation, memory, and records shared with Python.

In: laws written in Python, and messages.
Out: the same laws as native code, and views of native memory.
"""
