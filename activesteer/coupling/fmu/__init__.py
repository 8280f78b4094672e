"""FMUs for co-simulation, FMI 2.0 and 3.0, as controllers and drivers.

In: an FMU, which is code of others.
Out: a controller or driver for the loop.
"""

from activesteer.coupling.fmu.plugin import find_fmu, isolated

__all__ = ["find_fmu", "isolated"]
