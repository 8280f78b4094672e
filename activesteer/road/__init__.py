"""The road: surfaces, paths, lanes and courses.

In: keys of the table [road], CSV and OpenCRG files.
Out: paths, heights, slopes and friction, as arrays and as numbers for the engine.
"""
