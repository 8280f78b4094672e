"""The 1 ms loop, what searches and records around it, and one run from its inputs to a recording."""
