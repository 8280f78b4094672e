"""Tests by standards: runs on the study engine, evaluation, and verdicts against limits.

`standards.toml` says what each standard covers, and a function of a module drives it. `examination` judges the test and
writes its page.

In: a car with a controller.
Out: a verdict, metrics and a page.
"""
