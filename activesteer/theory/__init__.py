"""Formulas that need no multibody car, shared by controllers, driver, figures and identification."""
