"""A robot in somebody else's model moves as it does alone."""

from __future__ import annotations

import warnings

import mujoco
import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.core.inputs import LinkForce
from catheter_sim.core.posture import Posture
from catheter_sim.errors import InputError
from catheter_sim.modelling.attach import attach
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.simulation.together import step_together

# Two joints, so heavy and so stiffly held that no robot moves them.
ARM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{timestep}" integrator="discrete"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="upper" pos="0.1 -0.2 0.5">
      <joint name="shoulder" axis="0 1 0" damping="2e5" armature="1e3"/>
      <geom size="0.02" mass="1"/>
      <body name="lower" pos="0 0 0.2">
        <joint name="elbow" axis="1 0 0" damping="2e5" armature="1e3"/>
        <geom size="0.02" mass="1"/>
        <site name="flange" pos="0.01 0 0.1" euler="0.2 0 0.4"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder" kp="1e7"/>
    <position name="elbow" joint="elbow" kp="1e7"/>
  </actuator>
</mujoco>
"""
POSE = (0.7, -0.5)
PULLS = {
    "chest_tube_section": np.array([6.0]),
    "neuroendoscope_section": np.array([0.35, 0.0]),
    "neuroendoscope": np.array([0.2, 0.0, 0.0, 0.0, 0.2, 0.0]),
    "spacer_disk": np.array([2.0, 0.0, 2.0, 0.0]),
    "mitral_4dof": np.array([2e-3, 1e-3, 1e-3, 10e-3]),
}
SETTINGS = {
    "neuroendoscope": ("friction.mu=0.2",),
    "neuroendoscope_section": ("friction.mu=0.2",),
    "spacer_disk": ("disks_per_segment=3", "links_per_subsegment=1", "friction.mu=0.2"),
}


def on_an_arm(
    *references: str, further: tuple[str, ...] = ()
) -> tuple[list[Simulator], mujoco.MjModel, mujoco.MjData]:
    """Return simulators of robots: the first on an arm that stands in a pose, the others on its stand."""
    robots = [load_robot(reference, (*SETTINGS.get(reference, ()), *further)) for reference in references]
    timestep = min(robot.dynamics.timestep_s for robot in robots)
    spec = mujoco.MjSpec.from_string(ARM.format(timestep=timestep))
    spec.option.gravity = (1.0, 2.0, -9.0)
    places = [spec.site("flange"), *([spec.worldbody] * (len(robots) - 1))]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for robot, place in zip(robots, places, strict=True):
            attach(spec, robot, place, f"{robot.name}_")
        model = spec.compile()
    data = mujoco.MjData(model)
    for name, angle in zip(("shoulder", "elbow"), POSE, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = angle
        data.ctrl[model.actuator(name).id] = angle
    found = [Simulator(robot, model=model, data=data, prefix=f"{robot.name}_") for robot in robots]
    return found, model, data


def alone(simulator: Simulator) -> Simulator:
    """Return the same robot in a model of its own, under the gravity that its base frame has."""
    R_wb = simulator.data.xmat[simulator.place.base].reshape(3, 3)
    other = Simulator(simulator.robot, gravity_mps2=simulator.model.opt.gravity @ R_wb)
    other.model.opt.timestep = simulator.model.opt.timestep
    return other


def require_equal(one: Posture, other: Posture) -> None:
    """Require places to 1e-6 m, directions and angles to 1e-5 rad, tensions to 1e-4 of the largest.

    Tensions of a catheter's stiff antagonists, 1e6 N/m, to 1e-2 of it: 3e-7 m.
    """
    assert one.p_w == pytest.approx(other.p_w, abs=1e-6)
    assert one.R_w == pytest.approx(other.R_w, abs=1e-5)
    assert one.joint_angles == pytest.approx(other.joint_angles, abs=1e-5)
    share = 1e-2 if np.isnan(other.tendon_tension).all() else 1e-4
    near = share * float(other.actuator_tension.max()) + 1e-5
    assert one.actuator_tension == pytest.approx(other.actuator_tension, abs=near)
    assert one.tendon_tension == pytest.approx(other.tendon_tension, abs=near, nan_ok=True)


@pytest.mark.slow
@pytest.mark.parametrize("reference", PULLS)
def test_on_an_arm_that_is_held_it_is_as_alone_under_gravity_turned(reference: str) -> None:
    """Pulled out and half back, pushed at the tip and at an element: postures in the base frame are one."""
    (attached,), model, data = on_an_arm(reference)
    own = alone(attached)
    pushes = [LinkForce(1, (0.0, 0.0, 0.0), (2e-3, 1e-3, 0.0), (0.0, 1e-5, 0.0))]
    for level in [*np.linspace(0.0, 1.0, 41)[1:], *np.linspace(1.0, 0.5, 21)[1:]]:
        for simulator in (attached, own):
            simulator.set_inputs(level * PULLS[reference], (1e-3, -1e-3, 2e-3), (1e-6, 2e-6, 0.0), pushes)
            simulator.step(3)
        require_equal(attached.posture(), own.posture())
    assert np.linalg.norm(own.posture().p_w[-1, :2]) > 1e-3, "it bends"
    assert data.qpos[model.joint("elbow").qposadr[0]] == pytest.approx(POSE[1], abs=1e-6)
    for simulator in (attached, own):
        simulator.reset()
        simulator.step(5)
    require_equal(attached.posture(), own.posture())
    assert data.qpos[model.joint("elbow").qposadr[0]] == pytest.approx(POSE[1], abs=1e-6), "the arm stays"


@pytest.mark.parametrize("reference", ["chest_tube_section", "neuroendoscope_section"])
def test_a_turned_base_matters(reference: str) -> None:
    """Under gravity that is not turned with the base the tip is elsewhere: the test before has teeth."""
    (attached,), model, _ = on_an_arm(reference)
    other = Simulator(attached.robot, gravity_mps2=model.opt.gravity)
    for simulator in (attached, other):
        simulator.set_inputs(0.2 * PULLS[reference])
        assert simulator.settle()
    apart = np.abs(attached.posture().p_w - other.posture().p_w).max()
    assert apart > 1e-5


def test_on_a_slow_arm_it_swings_and_comes_back() -> None:
    """A second out and a second back: finite all the way, bent on the way, then where it was."""
    (attached,), model, data = on_an_arm("neuroendoscope_section", further=("friction.mu=0",))
    attached.set_inputs(np.array([0.1, 0.0]), (1e-3, 0.0, 0.0))
    elbow = model.actuator("elbow").id
    assert attached.settle()
    start = attached.posture().p_w
    steps = round(1.0 / model.opt.timestep)
    most = 0.0
    for share in [*np.linspace(0.0, 1.0, steps), *np.linspace(1.0, 0.0, steps)]:
        data.ctrl[elbow] = POSE[1] + 1.2 * share
        attached.step()
        attached.require_finite()
        most = max(most, float(np.abs(attached.posture().p_w - start).max()))
    assert attached.settle()
    assert most > 1e-5
    assert attached.posture().p_w == pytest.approx(start, abs=1e-6)


def test_two_robots_of_different_kinds_in_one_model_are_as_alone() -> None:
    """One on the arm, one beside it; each has its own inputs."""
    (tube, section), model, _ = on_an_arm("chest_tube_section", "neuroendoscope_section")
    own = [alone(tube), alone(section)]
    for level in np.linspace(0.0, 1.0, 61)[1:]:
        for simulators in ((tube, section), own):
            simulators[0].set_inputs(level * PULLS["chest_tube_section"], (0.0, 5e-3, 0.0))
            simulators[1].set_inputs(level * PULLS["neuroendoscope_section"])
        step_together([tube, section], 2)
        for simulator in own:
            simulator.step(2)
    for attached, other in zip((tube, section), own, strict=True):
        require_equal(attached.posture(), other.posture())
    tube.reset()
    assert tube.posture().p_w[-1, :2] == pytest.approx(np.zeros(2), abs=1e-9)
    assert section.posture().p_w == pytest.approx(own[1].posture().p_w, abs=1e-6), "the other one stays"
    assert model.geom_contype[[k for k in range(model.ngeom) if "tube" in model.geom(k).name]].sum() == 0


def test_what_does_not_fit_is_one_line() -> None:
    """Empty or taken prefixes, other integrators and longer steps, robots that are not there, options."""
    robot = load_robot("neuroendoscope_section")
    spec = mujoco.MjSpec.from_string(ARM.format(timestep=robot.dynamics.timestep_s))
    flange = spec.site("flange")
    with pytest.raises(InputError, match="prefix: must not be empty"):
        attach(spec, robot, flange, "")
    with pytest.raises(InputError, match="prefix 'fla': not to be told apart from 'flange'"):
        attach(spec, robot, flange, "fla")
    attach(spec, robot, flange, "a_")
    with pytest.raises(InputError, match="prefix 'a_b_': not to be told apart from 'a_base_frame'"):
        attach(spec, robot, flange, "a_b_")
    for change in ("timestep", "integrator"):
        other = mujoco.MjSpec.from_string(ARM.format(timestep=robot.dynamics.timestep_s))
        setattr(other.option, change, {"timestep": 1.0, "integrator": 0}[change])
        with pytest.raises(InputError, match=f"set spec.option.{change}"):
            attach(other, robot, other.site("flange"), "a_")
    model = spec.compile()
    with pytest.raises(InputError, match="not in the model with prefix 'b_': attach it first"):
        Simulator(robot, model=model, prefix="b_")
    with pytest.raises(InputError, match="not in the model with prefix 'a_': attach it first"):
        Simulator(load_robot("chest_tube_section"), model=model, prefix="a_")
    with pytest.raises(InputError, match="in a model of its own only: gravity_mps2"):
        Simulator(robot, gravity_mps2=(0.0, 0.0, -9.81), model=model, prefix="a_")
    one, two = (Simulator(robot, model=model, prefix="a_") for _ in range(2))
    with pytest.raises(InputError, match="not in one model with one state"):
        step_together([one, two])


@pytest.mark.parametrize(("contype", "conaffinity", "said"), [(0, 0, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)])
def test_a_scene_that_collides_is_warned_of_once(contype: int, conaffinity: int, said: int) -> None:
    """Robots have no contacts: two walls that could touch something are one warning, which names them."""
    spec = mujoco.MjSpec()
    for name in ("wall", "floor"):
        size = [0.01, 0.01, 0.01]
        spec.worldbody.add_geom(name=name, size=size, contype=contype, conaffinity=conaffinity)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        attach(spec, "neuroendoscope_section", spec.worldbody, "a_")
    assert len(found) == said
    for one in found:
        assert "robots touch nothing" in str(one.message)
        assert "(wall, floor)" in str(one.message)
        assert one.filename == __file__
    model = spec.compile()
    own = [model.geom(k).name.startswith("a_") for k in range(model.ngeom)]
    assert not model.geom_contype[own].any()


def test_arguments_of_another_kind_are_one_line() -> None:
    """The model, the place, the prefix, the robot, how it is driven."""
    spec, robot = mujoco.MjSpec(), load_robot("neuroendoscope_section")
    place = spec.worldbody
    with pytest.raises(InputError, match=r"spec = 'x': a mujoco.MjSpec that is not compiled yet is needed"):
        attach("x", robot, place, "a_")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="frame = None: a frame, body or site of the spec is needed"):
        attach(spec, robot, None, "a_")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="prefix = 3: a text is needed"):
        attach(spec, robot, place, 3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"robot = 5: a robot, its id or the path of its .toml is needed"):
        attach(spec, 5, place, "a_")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="unknown actuation 'push'; choices: tension, displacement"):
        attach(spec, robot, place, "a_", "push")


def test_an_empty_model_takes_the_robots_step_over() -> None:
    """Attached to a bare world it is the robot's own model, turned over: integrator and time step too."""
    robot = load_robot("chest_tube_section")
    spec = mujoco.MjSpec()
    attach(spec, robot, spec.worldbody.add_frame(euler=(180, 0, 0), pos=(0, 0, 1)), "a_")
    attached = Simulator(robot, model=spec.compile(), prefix="a_")
    own = alone(attached)
    assert attached.model.opt.integrator == own.model.opt.integrator
    assert attached.model.opt.timestep == robot.dynamics.timestep_s
    for simulator in (attached, own):
        simulator.set_inputs(np.array([5.0]))
        simulator.step(50)
    require_equal(attached.posture(), own.posture())
    down = attached.data.site_xpos[attached.faces[-1], 2]
    assert down == pytest.approx(1.0 - own.posture().p_w[-1, 2], abs=1e-6)
