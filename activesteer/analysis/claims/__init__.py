"""The paper's statements about the three systems, as checks on recordings.

`statements.toml` has a row for each statement, `judge` checks them, and `scorecard` combines verdicts with the reasons
of `not_reproduced.toml` and with the stored population.

In: recordings of the three systems.
Out: claims with their distances, and a scorecard.
"""
