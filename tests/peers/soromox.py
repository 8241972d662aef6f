"""The rod in SoRoMoX: planar links of constant strain, balanced by Newton's method on its own forces.

SoRoMoX has no solver for statics; its elastic force and its kinematics, differentiated by JAX, make one.
"""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from catheter_sim.arrays import Array
from peers.rods import DENSITY, ELEMENTS, LENGTH_M, POISSON, RADIUS_M, YOUNG_PA, Program

_CORRECTIONS = 8  # beyond the fifth nothing changes at these loads
_STEPS = 100


def program() -> Program:
    """Return SoRoMoX on the processor, in double precision.

    Raises:
        ImportError: it is not installed.
    """
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    import jax.numpy as jnp
    from soromox.systems.components import LinkSpec
    from soromox.systems.pcs import PlanarPCS

    link = LinkSpec.circular(
        length=LENGTH_M / ELEMENTS,
        radius=RADIUS_M,
        density=DENSITY,
        reference_strain=[0.0, 1.0, 0.0],
        young_modulus=YOUNG_PA,
        poisson_ratio=POISSON,
    )
    robot = PlanarPCS.from_links([link] * ELEMENTS, gravity=jnp.zeros(2), base_pose=jnp.zeros(3))
    start = jnp.zeros(robot.num_coordinates)

    def place(q: Any) -> Any:
        return robot.forward_kinematics(q, jnp.array(LENGTH_M))  # angle, along, across

    def unbalanced(q: Any, scale: Any, force: Any) -> Any:
        # The whole stiffness is in proportion to Young's modulus.
        return scale * robot.elastic_force(q) - jax.grad(lambda q: force * place(q)[2])(q)

    def solved(scale: Any, force: Any) -> Any:
        def corrected(_: int, q: Any) -> Any:
            slope = jax.jacfwd(unbalanced)(q, scale, force)
            return q - jnp.linalg.solve(slope, unbalanced(q, scale, force))

        return place(jax.lax.fori_loop(0, _CORRECTIONS, corrected, start))

    one = jax.jit(solved)
    many = jax.jit(jax.vmap(solved, in_axes=(None, 0)))
    rates = jax.jit(lambda y: robot.forward_dynamics(jnp.array(0.0), y))

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        found = one(scale, force_N).block_until_ready()
        return float(found[2]), float(found[1])

    def step() -> int:
        state = jnp.zeros(2 * robot.num_coordinates)
        for _ in range(_STEPS):
            rates(state).block_until_ready()
        return _STEPS

    def batch(forces: Array) -> object:
        return many(1.0, jnp.asarray(forces)).block_until_ready()

    return Program(
        f"SoRoMoX {version('soromox')}", tip, step, None, batch, 100,
        "constant strains, Newton's method by JAX; a step: its accelerations once",
    )  # fmt: skip
