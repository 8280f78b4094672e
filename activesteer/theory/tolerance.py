"""The tolerance function: activity of a corrector versus the error."""

from __future__ import annotations


def tolerance(error_radps: float, deadband_start_radps: float, deadband_end_radps: float) -> float:
    """Return the activity of a corrector: 0 inside the dead band, then a smooth cubic up to 1 (Fig. 9).

    Args:
        error_radps: Yaw rate error, either sign [rad/s].
        deadband_start_radps: Error up to which the corrector is inactive, c_off [rad/s].
        deadband_end_radps: Error from which the corrector is fully active, c_in [rad/s].

    Returns:
        Activity, 0 to 1.

    Source: Dorsch 2012, Fig. 9; the cubic is ours, since the figure shows no formula.
    """
    size = error_radps if error_radps >= 0.0 else -error_radps
    if size <= deadband_start_radps:
        return 0.0
    if size >= deadband_end_radps:
        return 1.0
    x = (size - deadband_start_radps) / (deadband_end_radps - deadband_start_radps)
    return x * x * (3.0 - 2.0 * x)
