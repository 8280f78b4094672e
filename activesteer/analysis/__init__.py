"""Metrics, claims, tables and plots, made from recordings and from nothing else.

- `metrics`: the numbers that belong to the manoeuvre of a recording: `step_response` by ISO 7401, `general` for others.
- `claims`: what the paper says about the three systems, as checks.
- `tables`, `plots`: the same for reading and looking. The plots need matplotlib (`pip install 'activesteer[plot]'`).
"""
