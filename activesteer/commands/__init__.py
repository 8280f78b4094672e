"""Commands of the command line. Each module registers its own with `add_to(commands)`.

In: the words of a command line.
Out: printed tables, files, and an exit status.
"""
