"""Metrics, claims, tables and figures, computed only from recordings.

- `metrics`: the metrics of a recording by its kind of manoeuvre: `step_response`, `frequency_response` (ISO 7401),
  `handling` (ISO 4138), `sine_with_dwell` (FMVSS 126), `braking` (ISO 7975, ISO 21994,
  ISO 14512), `path_following` (lane change, slalom, any path), and metrics of all runs.
- `claims`: the paper's statements about the three systems, as checks, with a scorecard.
- `tables`, `figures`: tables and figures of the metrics. The figures need matplotlib, the extra `plot`.

In: recordings.
Out: metrics, claims, harm, tables, figures and reports.
"""
