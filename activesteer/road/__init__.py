"""The road and what is on it: surfaces, paths, lanes, courses.

In: keys of the table [road], CSV and OpenCRG files.
Out: paths, heights, slopes and friction, as arrays and as numbers for the engine.
"""
