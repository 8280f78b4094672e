"""Parts of cars for rerun, films and the live view: bodies, wheel angles, tyre forces.

In: cars and channels of recordings.
Out: shapes, colours, and the table of panels that all views read.
"""
