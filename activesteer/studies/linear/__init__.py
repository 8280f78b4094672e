"""Linear analysis of a car: state space, modes, loop margins, and single-track model.

In: a car at a speed.
Out: state space, modes, margins and models for controllers.
"""
