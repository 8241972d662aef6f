"""Pictures of an environment: their shape, and the target where the camera's own matrix puts it."""

from __future__ import annotations

from collections.abc import Iterator

import gymnasium
import numpy as np
import pytest

from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.tip import frictionless_reach
from catheter_sim.modelling.build import FOVY_DEG, views
from catheter_sim.pictures.images import PinholeCamera, project, projection_matrix
from catheter_sim.pictures.offscreen import fitted_view

WIDTH, HEIGHT = 320, 240


@pytest.fixture  # of each test its own: in MuJoCo 3.17 a renderer that is closed spoils those that are open
def env() -> Iterator[ReachEnv]:
    made = gymnasium.make(
        "catheter_sim/NeuroendoscopeSectionReach-v0", render_mode="rgb_array", width=WIDTH, height=HEIGHT
    ).unwrapped
    assert isinstance(made, ReachEnv)
    yield made
    made.close()


def green(image: np.ndarray) -> np.ndarray:
    """Return which pixels show the target: nothing else is green."""
    red, strong, blue = image.astype(int).transpose(2, 0, 1)
    return (strong > red + 40) & (strong > blue + 40)


@pytest.mark.slow
def test_picture_has_its_shape_and_holds_robot_and_target(env: ReachEnv) -> None:
    """(height, width, 3) bytes, some of them the green target's, some the robot's."""
    env.reset(seed=0)
    image = env.render()
    assert image is not None
    assert image.shape == (HEIGHT, WIDTH, 3)
    assert image.dtype == np.uint8
    assert 20 < green(image).sum() < 0.05 * WIDTH * HEIGHT
    other = np.abs(image.astype(int) - image[2, 2]).max(axis=2) > 30
    assert (other & ~green(image)).sum() > 200


@pytest.mark.slow
def test_small_picture_is_the_mean_of_a_large_one(env: ReachEnv) -> None:
    """Drawn coarsely and averaged, it differs little from a fine one averaged; the target stays green."""
    arguments = {"observation": "pixels", "width": WIDTH // 5, "height": HEIGHT // 5}
    small = gymnasium.make("catheter_sim/NeuroendoscopeSectionReach-v0", **arguments)
    seen, info = small.reset(seed=3)
    env.reset(seed=3)
    assert env.target_m == pytest.approx(1e-3 * info["target_mm"], abs=1e-12)
    large = env.render()
    assert large is not None
    mean = large.reshape(HEIGHT // 5, 5, WIDTH // 5, 5, 3).mean(axis=(1, 3))
    assert seen.shape == mean.shape
    robot = np.abs(mean - mean[0, 0]).max(axis=2) > 30.0
    assert robot.sum() > 20
    apart = np.abs(seen - mean).max(axis=2)
    assert apart.mean() < 2.0
    assert apart[robot].mean() < 25.0
    assert green(seen).any()
    small.close()


@pytest.mark.slow
def test_target_is_drawn_where_the_camera_sees_it(env: ReachEnv) -> None:
    """The green pixels' centre is the target, projected by the camera's matrix, within a pixel."""
    side = next(view for view in views(env.plant.simulator.robot) if view.name == "side")
    reach = np.concatenate([frictionless_reach(env.plant)[1], np.zeros((1, 3))])
    view = fitted_view(side, reach, WIDTH, HEIGHT)
    right, up = view.axes
    axes = np.stack([right, up, view.backward], axis=1)
    matrix = projection_matrix(PinholeCamera(view.position, axes, np.radians(FOVY_DEG), WIDTH, HEIGHT))
    images = []
    for seed in (1, 2, 3):
        env.reset(seed=seed)
        image = env.render()
        assert image is not None
        rows, columns = np.nonzero(green(image))
        drawn = np.array([columns.mean() + 0.5, rows.mean() + 0.5])
        assert drawn == pytest.approx(project(matrix, env.target_m[np.newaxis])[0], abs=1.0)
        images.append(image)
    assert not np.array_equal(images[0], images[1])


@pytest.mark.slow
def test_drawing_leaves_the_simulation_alone(env: ReachEnv) -> None:
    """Not a byte of the simulator's state changes, and the sphere is no part of its model."""
    env.reset(seed=0)
    data, geoms = env.plant.simulator.data, env.plant.simulator.model.ngeom
    before = [data.qpos.copy(), data.qvel.copy(), data.site_xpos.copy(), data.ten_length.copy()]
    env.render()
    after = [data.qpos, data.qvel, data.site_xpos, data.ten_length]
    assert all(map(np.array_equal, before, after))
    assert env.plant.simulator.model.ngeom == geoms


@pytest.mark.slow
def test_close_frees_the_renderer_and_may_be_repeated(env: ReachEnv) -> None:
    """After `close` there is no renderer; the next picture opens another one."""
    env.reset(seed=0)
    first = env.render()
    env.close()
    env.close()
    assert env._picture is None
    assert np.array_equal(first, env.render())


def test_without_a_render_mode_nothing_is_drawn() -> None:
    """`render` says in one warning why there is no picture."""
    silent = ReachEnv("neuroendoscope_section")
    silent.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert silent.render() is None
