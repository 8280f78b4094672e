"""The paper's statements about the three systems, as checks on recordings.

`statements.toml` has a row for each statement, `judge` checks them, `stored` reads what the package stores about them,
and `scorecard` combines verdicts and reasons. `not_reproduced.toml` has the reasons of the claims that are known not to
be reproduced.

In: recordings of the three systems.
Out: claims with their distances, and a scorecard.
"""
