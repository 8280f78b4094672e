"""Description of an exported car in XML, for FMI 2.0 and 3.0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final
from xml.sax.saxutils import quoteattr

from activesteer.coupling.car.variables import INPUT, OUTPUT, PARAMETER, Variable
from activesteer.units import find_unit
from activesteer.version import __version__

_ABOUT: Final = (
    "Multibody car in MuJoCo; SI and radians; axes and signs of ISO 8855: x forward, y left, z up, left positive"
)


def model_description(
    variables: Sequence[Variable], identifier: str, token: str, version: int, timestep_s: float
) -> str:
    """Return the content of modelDescription.xml."""
    units = dict.fromkeys(variable.unit for variable in variables if variable.unit)
    defined = "".join(f"<Unit name={quoteattr(unit)}>{_base(unit)}</Unit>" for unit in units)
    state = "canGetAndSetFMU{0}='true' canSerializeFMU{0}='true'".format("state" if version == 2 else "State")
    can = f"canHandleVariableCommunicationStepSize='true' {state}"
    step = _number(timestep_s)
    elements = [_element(place, variable, version) for place, variable in enumerate(variables)]
    outputs = [place for place, variable in enumerate(variables) if variable.causality == OUTPUT]
    if version == 2:
        head = f"fmiVersion='2.0' guid='{token}'"
        can += " canNotUseMemoryManagementFunctions='true'"
        unknown = "".join(f"<Unknown index='{place + 1}'/>" for place in outputs)
        structure = f"<Outputs>{unknown}</Outputs><InitialUnknowns>{unknown}</InitialUnknowns>"
    else:
        head = f"fmiVersion='3.0' instantiationToken='{token}'"
        can += f" fixedInternalStepSize='{step}'"
        elements.append(
            f"<Float64 name='time' valueReference='{len(variables)}' causality='independent' variability='continuous'/>"
        )
        structure = "".join(f"<Output valueReference='{place}'/>" for place in outputs)
        structure += "".join(f"<InitialUnknown valueReference='{place}'/>" for place in outputs)
    newline = "\n"
    return (
        f"<?xml version='1.0' encoding='UTF-8'?>\n<fmiModelDescription {head} modelName={quoteattr(identifier)} "
        f"description={quoteattr(_ABOUT)} generationTool='activesteer {__version__}' "
        f"variableNamingConvention='flat'>\n<CoSimulation modelIdentifier='{identifier}' {can}/>\n"
        f"<UnitDefinitions>{defined}</UnitDefinitions>\n"
        f"<LogCategories><Category name='error' description='Failures'/></LogCategories>\n"
        f"<DefaultExperiment startTime='0' stopTime='10' stepSize='{step}'/>\n"
        f"<ModelVariables>\n{newline.join(elements)}\n</ModelVariables>\n"
        f"<ModelStructure>{structure}</ModelStructure>\n</fmiModelDescription>\n"
    )


def _base(name: str) -> str:
    unit = find_unit(name)
    given = zip(("kg", "m", "s", "rad"), unit.dimension if unit else (), strict=False)
    exponents = " ".join(f"{base}='{exponent}'" for base, exponent in given if exponent)
    return f"<BaseUnit {exponents}/>" if exponents else ""


def _number(value: float) -> str:
    return repr(float(value))


def _element(place: int, variable: Variable, version: int) -> str:
    """Return the element of a variable."""
    variability = {INPUT: "continuous", OUTPUT: "continuous", PARAMETER: "fixed"}[variable.causality]
    initial = {INPUT: "", OUTPUT: " initial='calculated'", PARAMETER: " initial='exact'"}[variable.causality]
    common = (
        f"name={quoteattr(variable.name)} valueReference='{place}' description={quoteattr(variable.meaning)} "
        f"causality='{variable.causality}' variability='{variability}'{initial}"
    )
    value = f" unit={quoteattr(variable.unit)}" if variable.unit else ""
    value += f" min='{_number(variable.low)}'" if math.isfinite(variable.low) else ""
    value += f" max='{_number(variable.high)}'" if math.isfinite(variable.high) else ""
    value += "" if variable.causality == OUTPUT else f" start='{_number(variable.start)}'"
    if version == 2:
        return f"<ScalarVariable {common}><Real{value}/></ScalarVariable>"
    return f"<Float64 {common}{value}/>"
