"""Build the example FMUs from their C sources, for FMI 2.0 and 3.0.

    make fmus
    activesteer run sine_with_dwell -c none -c afs -c build/fmus/paper_afs_fmi2.fmu

Needs a C compiler. Guide: docs/fmu_controller.md.
"""

import hashlib
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

HERE = Path(__file__).parent
LAWS = ("paper_afs", "yaw_damper")
VARIABLE = re.compile(r'V\((\w+), "(\w+)", (\w+), (\w+), ([-\d.e]+), "([^"]*)", "([^"]*)"\)')
UNITS = {
    "rad": "rad='1'",
    "rad/s": "rad='1' s='-1'",
    "m/s": "m='1' s='-1'",
    "m/s2": "m='1' s='-2'",
    "m": "m='1'",
    "deg": "rad='1' factor='0.017453292519943295'",
    "deg/s": "rad='1' s='-1' factor='0.017453292519943295'",
    "s": "s='1'",
}


def description(law, variables, version, token):
    """Return the model description: one element for each variable of the C source."""
    units = "".join(
        f"<Unit name='{unit}'><BaseUnit {UNITS[unit]}/></Unit>"
        for unit in dict.fromkeys(v[5] for v in variables)
        if unit
    )
    rows, unknowns = [], []
    for place, (_, name, causality, kind, start, unit, meaning) in enumerate(variables):
        continuous = "fixed" if causality == "parameter" else "continuous" if kind == "Real" else "discrete"
        common = f"name='{name}' valueReference='{place}' causality='{causality}' variability='{continuous}'"
        common += f" description={quoteattr(meaning)}"
        if causality == "output":
            common += " initial='calculated'"
            unknowns.append(place)
        value = f" start='{start}'" if causality != "output" else ""
        value += f" unit='{unit}'" if unit else ""
        if version == 2:
            rows.append(f"<ScalarVariable {common}><{kind}{value}/></ScalarVariable>")
        else:
            rows.append(f"<{'Float64' if kind == 'Real' else kind} {common}{value}/>")
    if version == 2:
        head = f"fmiVersion='2.0' guid='{token}' variableNamingConvention='flat'"
        can = "canHandleVariableCommunicationStepSize='true' canGetAndSetFMUstate='true' canSerializeFMUstate='true'"
        refer = "".join(f"<Unknown index='{place + 1}'/>" for place in unknowns)
        structure = f"<Outputs>{refer}</Outputs><InitialUnknowns>{refer}</InitialUnknowns>"
    else:
        rows.append(
            f"<Float64 name='time' valueReference='{len(rows)}' causality='independent' variability='continuous'/>"
        )
        head = f"fmiVersion='3.0' instantiationToken='{token}' variableNamingConvention='flat'"
        can = "canHandleVariableCommunicationStepSize='true' canGetAndSetFMUState='true' canSerializeFMUState='true'"
        refer = "".join(f"<{{}} valueReference='{place}'/>" for place in unknowns)
        structure = refer.replace("{}", "Output") + refer.replace("{}", "InitialUnknown")
    return (
        f"<?xml version='1.0' encoding='UTF-8'?>\n<fmiModelDescription {head} modelName='{law}'>"
        f"<CoSimulation modelIdentifier='{law}' {can}/><UnitDefinitions>{units}</UnitDefinitions>"
        f"<ModelVariables>{''.join(rows)}</ModelVariables><ModelStructure>{structure}</ModelStructure></fmiModelDescription>\n"
    )


def build(file, version, folder):
    """Compile a law and pack it, and return the FMU."""
    law, source = file.stem, file.read_text()
    token = hashlib.sha256(((HERE / "fmu.h").read_text() + source).encode()).hexdigest()[:32]
    variables = VARIABLE.findall(source)
    target = Path(folder) / f"{law}_fmi{version}.fmu"
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        library = Path(scratch) / f"{law}.so"
        # Without contraction the compiler rounds after every operation, as Python does.
        options = [
            "-O2",
            "-shared",
            "-fPIC",
            "-fvisibility=hidden",
            "-ffp-contract=off",
            f"-DFMI={version}",
            f'-DTOKEN="{token}"',
        ]
        subprocess.run(
            [os.environ.get("CC", "cc"), *options, f"-I{HERE}", str(file), "-o", str(library), "-lm"], check=True
        )
        archive.writestr("modelDescription.xml", description(law, variables, version, token))
        archive.write(library, f"binaries/{'linux64' if version == 2 else 'x86_64-linux'}/{law}.so")
    return target


if __name__ == "__main__":
    for law in LAWS:
        for version in (2, 3):
            print(build(HERE / f"{law}.c", version, sys.argv[1] if len(sys.argv) > 1 else "build/fmus"))
