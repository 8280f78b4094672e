"""The car as a library without Python: an FMU, or a shared library with a C header.

In: a scenario.
Out: an FMU, or a shared library with a header.
"""

from activesteer.coupling.car.export import Export, export_fmu, export_library

__all__ = ["Export", "export_fmu", "export_library"]
