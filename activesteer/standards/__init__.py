"""Whole tests of standards: their runs on the study engine, their evaluation, and their verdict against limits.

`standards.toml` says what each standard covers, and a function of a module drives it. `examination` judges the test and
writes its page.

In: a car with a controller.
Out: a verdict, metrics and a page.
"""
