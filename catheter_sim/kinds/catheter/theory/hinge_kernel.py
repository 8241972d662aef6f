"""Where hinges in a row are, and what a load does about them, in compiled loops: the text is in `hinges`."""

from __future__ import annotations

import math

from catheter_sim.mechanics.compiled import compiled

TOWARD_X, TOWARD_Y, AROUND_Z = 0, 1, 2


@compiled
def stand_rows(kind, link, angle, place, axis, turned):
    """Write where hinges are at each of m rows.

    Args:
        kind: of each hinge, shape (h,).
        link: straight way before each and beyond the last, shape (m, h + 1) [m].
        angle: shape (m, h) [rad].
        place: gets the hinges' places, and the tip, shape (m, h + 1, 3) [m].
        axis: gets their axes, shape (m, h, 3).
        turned: gets the frames before each hinge and beyond the last, their columns first, (m, h + 1, 3, 3).
    """
    rows, count = angle.shape
    for m in range(rows):
        for i in range(3):
            for j in range(3):
                turned[m, 0, i, j] = 1.0 if i == j else 0.0
            place[m, 0, i] = 0.0
        for k in range(count + 1):
            for i in range(3):
                before = place[m, k - 1, i] if k else 0.0
                place[m, k, i] = before + link[m, k] * turned[m, k, 2, i]
            if k == count:
                continue
            # Which two columns the hinge mixes, first' = cos first - sin second.
            first, second, which, sign = 0, 2, 1, 1.0
            if kind[k] == TOWARD_Y:
                first, second, which, sign = 1, 2, 0, -1.0
            elif kind[k] == AROUND_Z:
                first, second, which, sign = 1, 0, 2, 1.0
            sine, cosine = math.sin(angle[m, k]), math.cos(angle[m, k])
            for i in range(3):
                one, other = turned[m, k, first, i], turned[m, k, second, i]
                axis[m, k, i] = sign * turned[m, k, which, i]
                turned[m, k + 1, which, i] = turned[m, k, which, i]
                turned[m, k + 1, second, i] = sine * one + cosine * other
                turned[m, k + 1, first, i] = cosine * one - sine * other


@compiled
def _cross(a, b, out):
    """Write the vector product of two vectors, shape (3,) each."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def moment_rows(axis, place, centre, after, mass, force, moment, gravity, lever, turns, torque, slopes):
    """Write the load's moments about hinges at each of m rows, and their slopes.

    Args:
        axis, place: of the hinges, shape (m, h, 3) and, with the tip, (m, h + 1, 3) [m].
        centre, after, mass: of the n elements: centres of mass, shape (m, n, 3) [m], how many hinges come
            before each, and [kg].
        force, moment: on the tip, shape (m, 3) [N], [N m].
        gravity: shape (3,) [m/s^2].
        lever, turns: of shape (2, h, 3) each, overwritten.
        torque, slopes: get the moments, shape (m, h) [N m], and their slopes, shape (m, h, h).
    """
    rows, count = axis.shape[:2]
    for m in range(rows):
        for k in range(count):
            own = axis[m, k]
            weight = lever[1, k]
            arm = lever[0, k]
            for i in range(3):
                arm[i] = place[m, count, i] - place[m, k, i]
                weight[i] = 0.0
            for n in range(len(mass)):
                if after[n] > k and mass[n] != 0.0:
                    for i in range(3):
                        weight[i] += mass[n] * (centre[m, n, i] - place[m, k, i])
            _cross(own, arm, turns[0, k])
            _cross(own, weight, turns[1, k])
            torque[m, k] = 0.0
            for i in range(3):
                torque[m, k] += own[i] * moment[m, i] + turns[0, k, i] * force[m, i]
                torque[m, k] += turns[1, k, i] * gravity[i]
        for j in range(count):
            pushed, heavy, twisted = lever[0, 0], lever[0, 1], lever[1, 0]  # no longer needed
            _cross(force[m], axis[m, j], pushed)
            _cross(gravity, axis[m, j], heavy)
            _cross(moment[m], axis[m, j], twisted)
            for k in range(j, count):
                common = 0.0
                alone = 0.0
                for i in range(3):
                    common += turns[0, k, i] * pushed[i] + turns[1, k, i] * heavy[i]
                    alone += axis[m, k, i] * twisted[i]
                slopes[m, j, k] = common
                slopes[m, k, j] = common + (alone if k > j else 0.0)
