"""Random models with what the vehicle builder and a user's MJCF may hold, for comparing steps of the engine."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.vehicle import native_step
from activesteer.vehicle.implicit_plan import ImplicitPlan, drop_metric
from activesteer.vehicle.step_bindings import STEP_BINDINGS

STATE = ("qpos", "qvel", "act", "qacc", "sensordata", "actuator_force")
FRAME = """<mujoco><option timestep="{step}" integrator="discrete" tolerance="1e-14" iterations="1000" {options}>
<flag contact="disable" eulerdamp="disable" {flags}/></option>
<worldbody><site name="world"/>{world}{bodies}</worldbody>
<tendon>{tendons}</tendon><actuator>{actuators}</actuator><sensor>{sensors}</sensor></mujoco>"""


class RandomModel:
    """The MJCF text of a random tree of joints with links, servos and sensors.

    Attributes:
        xml: The model.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.joints: list[str] = []
        self.sites = ["world"]
        bodies = self._body("chassis", 1500.0, "<freejoint name='root'/>", int(rng.integers(3, 8)))
        if self._rarely():
            bodies += self._body("load", 30.0, "<freejoint/>", int(rng.integers(0, 2)))
        tendons = [self._tendon(f"t{index}") for index in range(rng.integers(3, 20))]
        actuators = [self._actuator() for _ in range(rng.integers(1, 8))]
        self.xml = FRAME.format(
            step=rng.choice([0.0005, 0.001, 0.002]),
            options=self._rare("viscosity='0.1'", "density='1.2'", "solver='PGS'", "solver='CG'", "cone='elliptic'"),
            flags=self._rare("energy='enable'", "autoreset='disable'", "gravity='disable'", "limit='disable'"),
            world="<body name='moved' mocap='true'><site name='mocap'/></body>",
            bodies=bodies,
            tendons="".join(tendons),
            actuators="".join(actuators),
            sensors=self._sensors(),
        )

    def _rarely(self) -> bool:
        return self.rng.random() < 0.015

    def _rare(self, *choices: str) -> str:
        return str(self.rng.choice(choices)) if self._rarely() else ""

    def _numbers(self, count: int, size: float = 1.0) -> str:
        return " ".join(f"{number:.5g}" for number in size * self.rng.normal(size=count))

    def _body(self, name: str, mass_kg: float, joints: str, children: int) -> str:
        inertia = " ".join(map(str, 0.1 * mass_kg * self.rng.uniform(1.0, 1.9, 3)))
        sites = [f"{name}_{index}" for index in range(3)]
        self.sites += sites
        lifted = self._rare("gravcomp='0.7'")
        text = f"<body name='{name}' pos='{self._numbers(3, 0.5)}' {lifted}>{joints}"
        text += f"<inertial mass='{mass_kg}' pos='{self._numbers(3, 0.1)}' diaginertia='{inertia}'/>"
        text += f"<geom name='{name}' type='cylinder' size='0.05 0.2' pos='{self._numbers(3, 0.3)}'/>"
        text += "".join(f"<site name='{site}' pos='{self._numbers(3, 0.4)}'/>" for site in sites)
        for index in range(children):
            child, mass_kg = f"{name}{index}", float(self.rng.uniform(2.0, 40.0))
            if self.rng.random() < 0.8 or not self.joints:
                own = "".join(self._joint(f"{child}_{part}") for part in range(self.rng.integers(1, 4)))
            else:
                extra = self._rare("stiffness='50'", "limited='true' range='0 0.1'")
                own = f"<joint name='{child}_ball' type='ball' {extra}/>"
            text += self._body(child, mass_kg, own, int(self.rng.integers(0, 2)))
        return text + "</body>"

    def _joint(self, name: str) -> str:
        self.joints.append(name)
        kind = self.rng.choice(["hinge", "slide"])
        reach = self.rng.choice([0.3, 30.0, 3000.0])
        extra = f"range='{-reach} {reach}' limited='true'" if self.rng.random() < 0.1 else ""
        extra += f" damping='{self.rng.uniform(-5.0, 50.0)}'" if self.rng.random() < 0.3 else ""
        extra += f" armature='{self.rng.uniform(0.0, 1.0)}'" if self.rng.random() < 0.2 else ""
        rare = self._rare(
            "actuatorfrclimited='true' actuatorfrcrange='-5 5'", "frictionloss='3'", "stiffness='100'",
            "actuatorgravcomp='true'", "margin='0.1'",
        )  # fmt: skip
        return f"<joint name='{name}' type='{kind}' axis='{self._numbers(3)}' {extra} {rare}/>"

    def _tendon(self, name: str) -> str:
        rng = self.rng
        extra = f" damping='{10 ** rng.uniform(0, 4)}'" if rng.random() < 0.7 else ""
        stiffness = f"{10 ** rng.uniform(2, 7):.5g}"
        if rng.random() < 0.2:
            stiffness += f" {self._numbers(1, 1e4)} {10 ** rng.uniform(3, 7):.5g}"
        if rng.random() < 0.3:
            extra += f" springlength='0.2 {0.2 + rng.uniform(0, 2)}'"
        extra += " " + self._rare(
            "limited='true' range='0 0.5'", "frictionloss='10'", "armature='1'", "springyield='100'",
            "actuatorfrclimited='true' actuatorfrcrange='-5 5'",
        )  # fmt: skip
        if rng.random() < 0.2 and len(self.joints) > 1:
            pair = rng.choice(self.joints, 2, replace=False)
            path = "".join(f"<joint joint='{joint}' coef='{rng.normal():.5g}'/>" for joint in pair)
            return f"<fixed name='{name}' stiffness='{stiffness}' {extra}>{path}</fixed>"
        first, second, third = rng.choice([*self.sites, "mocap"], 3, replace=False)
        between = rng.choice(["", "", "", f"<site site='{third}'/>", "<geom geom='chassis'/>"])
        if rng.random() < 0.05:
            between = f"<site site='{third}'/><pulley divisor='2'/><site site='{third}'/>"
        if "geom" in between:
            extra = extra.replace("armature='1'", "")
        path = f"<site site='{first}'/>{between}<site site='{second}'/>"
        return f"<spatial name='{name}' stiffness='{stiffness}' {extra}>{path}</spatial>"

    def _actuator(self) -> str:
        rng = self.rng
        joint, site, other = rng.choice(self.joints), rng.choice(self.sites[1:]), rng.choice(self.sites[1:])
        limit = f"forcelimited='true' forcerange='-{rng.uniform(1, 500)} {rng.uniform(1, 500)}'"
        bound = limit if rng.random() < 0.3 else ""
        extra = bound + " " + self._rare("armature='0.1'", "damping='2'", "delay='0.002' nsample='5'", "group='2'")
        kp, kv = 10 ** rng.uniform(0, 5), 10 ** rng.uniform(0, 3)
        return str(
            rng.choice(
                [
                    f"<position joint='{joint}' kp='{kp}' kv='{kv}' {extra}/>",
                    f"<position joint='{joint}' kp='{kp}' timeconst='0.05' gear='-3' {extra}/>",
                    f"<velocity joint='{joint}' kv='{kv}' {extra}/>",
                    f"<motor joint='{joint}' gear='{rng.normal():.5g}' {extra}/>",
                    f"<motor site='{site}' refsite='{other}' gear='{self._numbers(6)}' {bound}/>",
                    f"<motor tendon='t0' gear='50' {extra}/>",
                    "<motor joint='root' gear='1 2 3 0.1 0.2 0.3'/>",
                    f"<general joint='{joint}' dyntype='filter' dynprm='0.01' gainprm='30' biastype='affine' "
                    f"biasprm='{self._numbers(3, 100.0)}' actearly='true' {extra}/>",
                    *(
                        [f"<position tendon='t0' kp='500' {extra}/>", f"<muscle joint='{joint}' lengthrange='-1 1'/>"]
                        if self._rarely()
                        else []
                    ),
                ]
            )
        )

    def _sensors(self) -> str:
        rng, joint, site = self.rng, self.rng.choice(self.joints), self.rng.choice(self.sites[1:])
        frames = ("framelinacc", "frameangacc", "framelinvel", "framepos", "framexaxis")
        choices = [
            f"<accelerometer site='{site}'/>", f"<gyro site='{site}'/>", f"<force site='{site}'/>",
            f"<torque site='{site}'/>", f"<jointpos joint='{joint}'/>",
            f"<jointvel joint='{joint}' delay='0.002' nsample='4'/>",
            f"<jointactuatorfrc joint='{joint}'/>", "<tendonpos tendon='t0'/>", "<subtreelinvel body='chassis'/>",
            "<e_kinetic/>", *(f"<{name} objtype='site' objname='{site}'/>" for name in frames),
        ]  # fmt: skip
        chosen = rng.choice(choices, rng.integers(0, 5), replace=False)
        return "<accelerometer site='chassis_0'/>" + "".join(chosen) + self._rare("<e_potential/>")


def thrown(model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator) -> None:
    """Put a model into an odd pose, moving."""
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv) * rng.choice([0.0, 0.01, 0.5]), 1.0)
    data.qvel[:] = rng.normal(size=model.nv) * rng.choice([0.0, 1.0, 10.0])
    data.act[:] = 0.1 * rng.normal(size=model.na)
    data.qfrc_applied[:] = rng.normal(size=model.nv)


class Stepper:
    """A model that steps by a plan, without a car."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self.data, self.implicit = data, ImplicitPlan(model, data)
        self._plan = np.zeros(1, STEP_BINDINGS)
        self._plan["implicit"], self._plan["ctrl"] = self.implicit.plan.ctypes.data, data.ctrl.ctypes.data
        drop_metric(model, data)

    @property
    def direct(self) -> bool:
        return bool(self.implicit.plan["direct"][0])

    def step(self, inputs: NDArray[np.float64]) -> None:
        """Make one step for each row of inputs."""
        native_step.replay(self._plan.ctypes.data, np.ascontiguousarray(inputs))


def differences(ours: mujoco.MjData, engine: mujoco.MjData) -> dict[str, float]:
    """Return the largest difference of each array, relative to its largest number or 1."""
    found: dict[str, Any] = {}
    for name in STATE:
        here, there = getattr(ours, name), getattr(engine, name)
        if there.size:
            found[name] = float(np.abs(here - there).max() / max(np.abs(there).max(), 1.0))
    return found
