"""Whole tests of standards: their runs on the study engine, their evaluation, the verdict where they have limits.

Every standard is one module with one `Standard`, listed in `catalogue`; `examination` drives and judges, `page` writes
the page.
"""
