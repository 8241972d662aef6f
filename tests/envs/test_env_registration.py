"""The environments are found by their ids, from a fresh interpreter too."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import pytest

from catheter_sim.envs import CLINICAL_STEPS, EPISODE_STEPS, register_environments

ROBOTS = (
    "Neuroendoscope",
    "NeuroendoscopeSection",
    "ChestTube",
    "ChestTubeSection",
    "MitralTransseptal",
    "Mitral4dof",
    "NotchedWrist",
)
CLINICAL = ("NeuroendoscopeTumour", "ChestTubeInsert", "MitralTransseptalDeliver", "Mitral4dofDeliver")
TASKS = (*(robot + task for robot in ROBOTS for task in ("Reach", "Track")), *CLINICAL)
IDS = (
    *(f"catheter_sim/{name}-v0" for name in TASKS),
    *(f"catheter_sim/{robot}Track-v1" for robot in ROBOTS),
)


def fresh(code: str) -> str:
    """Return what a new interpreter prints, every warning an error."""
    ran = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert not ran.stderr
    return ran.stdout.strip()


@pytest.mark.slow
def test_fresh_interpreter_makes_the_environment_by_an_id_that_names_the_package() -> None:
    """`gymnasium.make("catheter_sim:...")` needs no import before it, and warns of nothing."""
    code = (
        f"import gymnasium; env = gymnasium.make('catheter_sim:{IDS[0]}'); print(env.reset(seed=0)[0].shape)"
    )
    assert fresh(code) == "(27,)"


def test_import_registers_and_loads_no_engine() -> None:
    """`import catheter_sim` registers, and leaves MuJoCo and the compiler for later."""
    code = (
        "import sys, catheter_sim, gymnasium; late = 'mujoco', 'numba', 'scipy', 'matplotlib', 'dm_control'; "
        "print([name for name in late if name in sys.modules], "
        "sum(name.startswith('catheter_sim/') for name in gymnasium.registry))"
    )
    assert fresh(code) == f"[] {len(IDS)}"


def test_registration_is_idempotent_and_limits_episodes(recwarn: pytest.WarningsRecorder) -> None:
    """Registering again changes nothing; every environment is truncated, clinical ones after 200 steps."""
    before = {name: gymnasium.registry[name] for name in IDS}
    register_environments()
    assert all(gymnasium.registry[name] is spec for name, spec in before.items())
    for name, spec in before.items():
        reaches = name.endswith(("Reach-v0", "Track-v0", "Track-v1"))
        assert spec.max_episode_steps == (EPISODE_STEPS if reaches else CLINICAL_STEPS)
    assert (EPISODE_STEPS, CLINICAL_STEPS) == (100, 200)
    assert not recwarn.list
