"""Formulas that need no multibody car: known to controllers, driver, figures and identification alike."""
