"""Many runs: the engine that makes them, linear analysis of the car, and the paper's studies.

In: study files.
Out: tables of runs, searches, margins, and the scorecard of the claims.
"""
