"""Commands of the command line. Each module has `add_to(commands)`."""
