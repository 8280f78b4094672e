"""Whole tests of standards: their runs on the study engine, their evaluation, and their verdict against limits.

Every standard is one module with one `Standard`, listed in `catalogue`. `examination` drives and judges the test and
writes its page.

In: a car with a controller.
Out: a verdict, metrics and a page.
"""
