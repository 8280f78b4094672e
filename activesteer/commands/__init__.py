"""Commands of the command line, which each module adds by `add_to(commands)`.

In: the words of a command line.
Out: printed tables, files, and an exit status.
"""
