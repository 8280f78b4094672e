"""Linear analysis of a car: state space, modes, loop margins, and the single-track model of its runs."""
