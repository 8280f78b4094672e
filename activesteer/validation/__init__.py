"""Comparison of a car with what another multibody code says of the same car."""

from activesteer.validation.comparison import Comparison, to_json
from activesteer.validation.programme import Validation, validate

__all__ = ["Comparison", "Validation", "to_json", "validate"]
