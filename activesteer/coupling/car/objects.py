"""Object code of the native step and of the engine's callbacks, for any processor with AVX2.

The code comes from the same kernels as that of a simulation, so that both give the same numbers to the last bit.
numba keeps the compiled module in an interface of its own (`_library`), which may change with a new version.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from activesteer.errors import ModelError

PROCESSOR: Final = "x86-64-v3"
"""Processor for which code is made: x86-64 with AVX2 and FMA (Haswell, 2013; Zen, 2017)."""


class Code(NamedTuple):
    """Compiled code of one function.

    Attributes:
        name: Name of the function in the object.
        content: The object file.
    """

    name: str
    content: bytes


def car_code() -> dict[str, Code]:
    """Return the code of `step`, `derive` and `fault` (`entry`) and of the callbacks `passive`, `act_dyn`, `sensor`."""
    # Compiles for half a minute at first use.
    from activesteer.coupling.car.entry import car_step, derive, fault  # noqa: PLC0415
    from activesteer.vehicle.engine_layout import engine_layout  # noqa: PLC0415
    from activesteer.vehicle.native_forces import _make_callbacks  # noqa: PLC0415

    passive, act_dyn, sensor = _make_callbacks(engine_layout())
    functions = {
        "step": car_step, "derive": derive, "fault": fault, "passive": passive, "act_dyn": act_dyn, "sensor": sensor,
    }  # fmt: skip
    return {name: _code(name, function) for name, function in functions.items()}


def _code(name: str, function: Any) -> Code:
    import llvmlite.binding as llvm  # noqa: PLC0415
    import numba  # noqa: PLC0415

    try:
        module = llvm.parse_assembly(str(function._library._get_module_for_linking()))
        wrapper = function._wrapper_name
        entry = module.get_function(wrapper)
    except (AttributeError, NameError, RuntimeError) as reason:
        raise ModelError(
            f"the car cannot be exported with numba {numba.__version__}, which keeps compiled code elsewhere "
            f"({type(reason).__name__}: {reason}); numba 0.61 to 0.68 work",
            value=numba.__version__,
        ) from reason
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration:
            part.linkage = "internal"
    entry.linkage = "external"
    entry.name = f"activesteer_{name}"
    machine = llvm.Target.from_triple("x86_64-unknown-linux-gnu").create_target_machine(
        cpu=PROCESSOR, opt=3, reloc="pic", codemodel="default"
    )
    return Code(entry.name, machine.emit_object(module))
