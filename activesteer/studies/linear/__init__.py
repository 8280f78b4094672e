"""Linear analysis of a car: state space, modes, loop margins, and the single-track model of its runs.

In: a car at a speed.
Out: state space, modes, margins and models for controllers.
"""
