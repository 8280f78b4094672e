"""The 1 ms loop, its searches and recorders, and complete runs.

In: a `Scenario` with a controller and a driver.
Out: recordings, or measurements step by step.
"""
