"""Many runs: the study engine, linear analysis, and the paper's studies.

In: study files.
Out: tables of runs, searches, margins, and the scorecard of the claims.
"""
