"""The road and what lies on it: surfaces, paths, lanes, courses."""
