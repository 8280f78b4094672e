"""The study engine: plan the runs of a study file, drive them on workers, store and analyse their rows.

In: a study file.
Out: a folder with the runs, their metrics, and a page.
"""
