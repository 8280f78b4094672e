"""Comparison of a car with the same car in another multibody code, or with a measurement on the road."""

from activesteer.validation.comparison import Comparison, to_json
from activesteer.validation.programme import Validation, validate

__all__ = ["Comparison", "Validation", "to_json", "validate"]
