"""The crawler's equations as a loop for numba: planar, two legs of weight 2, what the shipped robot is, and no more.

Numbers are scalars throughout, nothing is allocated in the loop, and only the last window is kept.
"""

from math import cos, exp, pi, sin, sqrt

import numba
import numpy as np

_MASS, _WATER, _G, _OMEGA = 0.755, 1025.0, 9.80665, 12.4602
_CRANK, _BEARING, _LEG, _AHEAD, _UP = 0.0105, 0.0998, 0.1263, 0.0366, 0.0049
_LIFT, _OFF_X, _OFF_Z = 0.609854604e-3 * _WATER * _G, 0.0196329, 0.0878325
_SOFTNESS, _FALL, _START = 1e-3, 0.05, 0.13
_LEAN = pi / 3


@numba.njit(inline="always")
def _leg(p, ahead, c, s, qc, qs, z, vx, vz, w, e):
    """Force of one foot [N], its place from the centre [m], and the rate of the stretch e."""
    k, ratio, mu_s, mu_d, along, across = p[0], p[1], p[2], p[3], p[8], p[9]
    damping = 2 * ratio * sqrt(k * _MASS)
    px, pz = _CRANK * qc, _CRANK * qs
    dpx, dpz = -_OMEGA * pz, _OMEGA * px
    ux, uz = -px, -_BEARING - pz
    far = sqrt(ux * ux + uz * uz)
    ux, uz = ux / far, uz / far
    turn = _LEG / far * (uz * dpx - ux * dpz)
    x, h = ahead + px + _LEG * ux, _UP + pz + _LEG * uz
    dx, dh = dpx - turn * uz, dpz + turn * ux
    # to world axes
    ax, az = c * x - s * h, s * x + c * h
    ux, uz = c * ux - s * uz, s * ux + c * uz
    fx, fz = vx - w * az + c * dx - s * dh, vz + w * ax + s * dx + c * dh
    depth = -(z + az)
    grip = min(max(depth / _SOFTNESS, 0.0), 1.0)
    up = k * max(depth, 0.0) - grip * damping * fz
    push = max(up, 0.0)
    held = k * e - damping * fx
    slide = 0.0
    if push > 0.0:
        needed = abs(held)
        most = (mu_d + (mu_s - mu_d) * exp(-max(needed / push - mu_s, 0.0) / _FALL)) * push
        slide = min(max(held, -most), most)
    vt, vn = fx * ux + fz * uz, -fx * uz + fz * ux
    t, n = -(1 - grip) * along * abs(vt) * vt, -(1 - grip) * across * abs(vn) * vn
    return slide + t * ux - n * uz, up + t * uz + n * ux, ax, az, (slide - k * e) / damping


@numba.njit(inline="always")
def _rate(t, p, z, th, vx, vz, w, e1, e2):
    added, J, drag, turning = p[4], p[5], 0.5 * _WATER * p[6], 1e-3 * _WATER * p[7]
    c, s = cos(th), sin(th)
    phi = _OMEGA * t - pi / 2
    qc, qs = cos(phi), sin(phi)
    fx1, fz1, ax1, az1, de1 = _leg(p, _AHEAD, c, s, qc, qs, z, vx, vz, w, e1)
    fx2, fz2, ax2, az2, de2 = _leg(p, -_AHEAD, c, s, qc, qs, z, vx, vz, w, e2)
    bx, bz = c * vx + s * vz, -s * vx + c * vz
    dx, dz = -drag * abs(bx) * bx, -drag * abs(bz) * bz
    fx = 2 * (fx1 + fx2) + c * dx - s * dz
    fz = 2 * (fz1 + fz2) + s * dx + c * dz + _LIFT - _MASS * _G
    moment = 2 * (ax1 * fz1 - az1 * fx1 + ax2 * fz2 - az2 * fx2) - turning * abs(w) * w
    moment += _LIFT * (c * _OFF_X - s * _OFF_Z)
    return vx, vz, w, fx / (_MASS + added), fz / (_MASS + added), moment / J, de1, de2


@numba.njit
def _walk(p, steps, window, h, seen):
    """Classical Runge-Kutta; x and z of the last window into `seen`; when it fell [s], inf if it did not."""
    x, z, th, vx, vz, w, e1, e2 = 0.0, _START, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    fell = np.inf
    for i in range(steps):
        if i >= steps - window:
            seen[0, i - steps + window], seen[1, i - steps + window] = x, z
        t, g = i * h, 0.5 * h
        a = _rate(t, p, z, th, vx, vz, w, e1, e2)
        b = _rate(
            t + g, p, z + g * a[1], th + g * a[2], vx + g * a[3], vz + g * a[4], w + g * a[5], e1 + g * a[6],
            e2 + g * a[7],
        )  # fmt: skip
        d = _rate(
            t + g, p, z + g * b[1], th + g * b[2], vx + g * b[3], vz + g * b[4], w + g * b[5], e1 + g * b[6],
            e2 + g * b[7],
        )  # fmt: skip
        f = _rate(
            t + h, p, z + h * d[1], th + h * d[2], vx + h * d[3], vz + h * d[4], w + h * d[5], e1 + h * d[6],
            e2 + h * d[7],
        )  # fmt: skip
        m = h / 6
        x += m * (a[0] + 2 * b[0] + 2 * d[0] + f[0])
        z += m * (a[1] + 2 * b[1] + 2 * d[1] + f[1])
        th += m * (a[2] + 2 * b[2] + 2 * d[2] + f[2])
        vx += m * (a[3] + 2 * b[3] + 2 * d[3] + f[3])
        vz += m * (a[4] + 2 * b[4] + 2 * d[4] + f[4])
        w += m * (a[5] + 2 * b[5] + 2 * d[5] + f[5])
        e1 += m * (a[6] + 2 * b[6] + 2 * d[6] + f[6])
        e2 += m * (a[7] + 2 * b[7] + 2 * d[7] + f[7])
        if (abs(th) > _LEAN or z < 0.0) and fell == np.inf:
            fell = (i + 1) * h
    seen[0, window], seen[1, window] = x, z
    return fell


@numba.njit
def walks(rows, seconds, length, h):
    """Amplitude, frequency, speed and height in the last window of each walk, and when it fell."""
    steps, window = round(seconds / h), round(length / h)
    gait, fell, seen = np.empty((len(rows), 4)), np.empty(len(rows)), np.empty((2, window + 1))
    for k in range(len(rows)):
        fell[k] = _walk(rows[k], steps, window, h, seen)
        x, z = seen
        mean = z.mean()
        first, last, turns = 0.0, 0.0, -1
        for i in range(window):
            below, above = z[i] - mean, z[i + 1] - mean
            if below < 0 and above >= 0:
                last = i - below / (above - below)
                first = last if turns < 0 else first
                turns += 1
        gait[k, 0], gait[k, 2], gait[k, 3] = z.max() - z.min(), (x[-1] - x[0]) / length, mean
        gait[k, 1] = turns / ((last - first) * h) if turns > 0 else 0.0
    return gait, fell
