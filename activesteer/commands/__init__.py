"""Commands of the command line. Each module has `add_to(commands)`.

In: the words of a command line.
Out: printed tables, files, and an exit status.
"""
