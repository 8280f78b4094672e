"""Formulas that need no multibody car, for controllers, driver, figures and identification.

In: parameters of simple models.
Out: steady states and responses, as formulas.
"""
