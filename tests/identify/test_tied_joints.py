"""Joints that follow an axis by an equality of their file, and tendons."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from arms import (
    ARM,
    COULOMB,
    JOINTS,
    SAMPLE,
    VISCOUS,
    arm_of,
    friction,
)

from identify.analysis.first_model import first_model
from identify.workflow import compare, fit
from twin.effects import load_catalogue

TIED = ARM.replace(
    "</mujoco>",
    '<equality><joint joint1="elbow" joint2="shoulder" polycoef="0.2 -1.5" solref="0.002 1"/>'
    "</equality></mujoco>",
)


def tied_log(seed):
    """The arm whose elbow follows the shoulder, under a velocity loop of the two others."""
    model = mujoco.MjModel.from_xml_string(TIED)
    model.opt.timestep = SAMPLE / 4
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    rate, size = 2.0 * np.pi * rng.uniform(0.1, 0.7, (3, 2)), rng.uniform(0.2, 0.5, (3, 2))
    at = rate * (SAMPLE * np.arange(3000))[:, None, None] + rng.uniform(0.0, 6.0, (3, 2))
    wanted, speed = (size * np.sin(at)).sum(axis=1), (size * rate * np.cos(at)).sum(axis=1)
    position, command = np.empty((2, *wanted.shape))
    by, gain = np.array([[1, 0], [0, 1], [0, -1.5]]), np.array([25.0, 40.0])
    data.qpos[:], data.qvel[:] = by @ wanted[0] + [0.0, 0.0, 0.2], by @ speed[0]
    for k in range(len(wanted)):
        torque = gain * (speed[k] - data.qvel[:2] + 8.0 * (wanted[k] - data.qpos[:2]))
        position[k] = data.qpos[:2] - 0.5 * model.opt.timestep * data.qvel[:2]
        command[k] = torque
        for _ in range(4):
            data.qfrc_applied[:2] = torque + friction(data.qpos, data.qvel)[:2]
            mujoco.mj_step(model, data)
    position += 1e-6 * rng.standard_normal(position.shape)
    log = arm_of(np.pad(position, [(0, 0), (0, 1)]), np.pad(command, [(0, 0), (0, 1)]))
    return replace(log, axes={joint: log.axes[joint] for joint in JOINTS[:2]})


@pytest.mark.slow
def test_a_joint_that_follows_an_axis_needs_no_sensor():
    logs = {str(seed): tied_log(seed) for seed in (1, 2)}
    model = first_model(logs, "arm", load_catalogue(), ("arm.xml", TIED))
    found = fit(model, logs)
    for joint, coulomb, viscous in zip(JOINTS[:2], COULOMB, VISCOUS, strict=False):
        values = found.fits[joint].axis["coulomb_viscous"].values
        assert values["Fc"] == pytest.approx(coulomb, rel=0.02)
        assert values["sigma2"] == pytest.approx(viscous, rel=0.02)
    run = compare(found.model, {"1": logs["1"]}).axes
    assert all(max(run[joint].position_error.values()) < 2e-3 for joint in JOINTS[:2])
