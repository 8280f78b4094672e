"""The 1 ms loop, the searches and recorders around it, and one run from its inputs to a recording.

In: a `Scenario` with a controller and a driver.
Out: recordings, or measurements step by step.
"""
