"""Pose of a rigid body from the positions of its markers, with standard errors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int8

from nectosome.units import InputError

from .camera import inverse
from .point_checks import FLAT, axes, refuse_same
from .triangulate import PlaceStatus

_GIMBAL = 0.02  # cosine of pitch, about 1 deg from 90 deg


@dataclass(frozen=True, eq=False)
class BodyPose:
    """Pose of a body in the world; unknown values are NaN, with the reason in `status`."""

    place: Float[np.ndarray, "t 3"]  # of the body frame's origin [m]
    rotation: Float[np.ndarray, "t 3 3"]  # from the body frame to the world
    angles: Float[np.ndarray, "t 3"]  # roll, pitch, yaw [rad]
    residual: Float[np.ndarray, "t"]  # [m] rms distance between measured and fitted markers
    place_se: Float[np.ndarray, "t 3"]  # [m]; NaN without a covariance of the markers
    angles_se: Float[np.ndarray, "t 3"]  # [rad]
    status: Int8[np.ndarray, "t"]  # a `PlaceStatus`


def pose(
    places: Float[np.ndarray, "t m 3"],
    body: Float[np.ndarray, "m 3"],
    *,
    covariance: Float[np.ndarray, "t m 3 3"] | None = None,
    unwrap: bool = False,
) -> BodyPose:
    r"""Rotation R and origin x that minimise $\sum_i |p_i - x - R b_i|^2$ (Kabsch 1976; Umeyama, PAMI 13 (1991) 376).

    p_i are `places` of markers in the world [m] (NaN: unknown), b_i the same markers in the `body` frame. R = Rz(yaw)
    Ry(pitch) Rx(roll), det R = 1; pitch in [-pi/2, pi/2], roll and yaw in (-pi, pi], or with `unwrap` continuous from
    frame to frame, also over gaps. `covariance` [m2] is that of each marker, with independent errors; the errors of the
    pose follow by linear propagation. Within 1.1 deg of pitch = +-pi/2, roll and yaw are not separable
    (PlaceStatus.GIMBAL): the rotation is valid, the standard errors of the angles are large.

    A frame needs three markers that are not on a line. Exchanged markers show in the residual, unless the body has that
    symmetry. A mirrored body shows in the residual, unless its markers lie in a plane, as three do: then the body is
    turned over. Raises InputError for fewer than three markers, markers on a line, and equal markers; ValueError for
    shapes that do not match.
    """
    p, b = np.array(places, float), np.array(body, float)
    t, m = len(p), len(b)
    if b.shape != (m, 3) or p.shape != (t, m, 3):
        raise ValueError(f"pose: places [t, m, 3] and body [m, 3] are expected; they are {p.shape} and {b.shape}.")
    if covariance is not None and np.shape(covariance) != (t, m, 3, 3):
        raise ValueError(f"pose: covariance is {np.shape(covariance)}, and {(t, m, 3, 3)} is expected.")
    _refuse_body(b)
    there = np.all(np.isfinite(p), axis=2)
    status = _status(there, b)
    use = status == PlaceStatus.GOOD
    w, p = there[use].astype(float), np.where(there[use][..., None], p[use], 0)
    count = w.sum(axis=1)
    bm, pm = w @ b / count[:, None], p.sum(axis=1) / count[:, None]
    bc, pc = w[..., None] * (b - bm[:, None]), w[..., None] * (p - pm[:, None])
    U, _, V = np.linalg.svd(pc.transpose(0, 2, 1) @ bc)
    U[:, :, 2] *= np.linalg.det(U @ V)[:, None]
    R = U @ V
    q = bc @ R.transpose(0, 2, 1)
    arm = np.einsum("tij,tj->ti", R, bm)
    angles = roll_pitch_yaw(R)
    status[np.flatnonzero(use)[np.cos(angles[:, 1]) < _GIMBAL]] = PlaceStatus.GIMBAL
    out = {
        "place": pm - arm,
        "rotation": R,
        "angles": angles,
        "residual": np.sqrt(np.sum((pc - q) ** 2, axis=(1, 2)) / count),
        "place_se": np.full((len(R), 3), np.nan),
        "angles_se": np.full((len(R), 3), np.nan),
    }
    if covariance is not None:
        marker = np.where(there[use][..., None, None], np.asarray(covariance, float)[use], 0)
        out["place_se"], out["angles_se"] = _errors(q, pc, arm, angles, w, marker)
    full: dict[str, np.ndarray] = {}
    for name, values in out.items():
        full[name] = np.full((t, *values.shape[1:]), np.nan)
        full[name][use] = values
    if unwrap:
        full["angles"][use] = np.unwrap(full["angles"][use], axis=0)
    return BodyPose(**full, status=status)


def _refuse_body(b: Float[np.ndarray, "m 3"]) -> None:
    if not np.isfinite(b).all():
        raise InputError("has a marker with NaN or infinite coordinates.", field="body")
    if len(b) < 3:
        raise InputError(f"has {len(b)} markers, and a pose needs three.", field="body")
    refuse_same(b, "body")
    spread = axes(b)
    if spread[1] < FLAT * spread[0]:
        raise InputError(
            f"has its markers on a line, {spread[1]:.2g} m (rms) off it, {100 * spread[1] / spread[0]:.2g} % of their "
            f"spread of {spread[0]:.3g} m: the rotation about it is unknown. Put one clearly off it.",
            field="body",
        )


def _status(there: Bool[np.ndarray, "t m"], b: Float[np.ndarray, "m 3"]) -> Int8[np.ndarray, "t"]:
    """Status of the pose of each frame by its visible markers."""
    seen, which = np.unique(there, axis=0, return_inverse=True)
    kinds = np.full(len(seen), PlaceStatus.GOOD, np.int8)
    for k, markers in enumerate(seen):
        if np.count_nonzero(markers) < 3:
            kinds[k] = PlaceStatus.FEW_MARKERS
        else:
            spread = axes(b[markers])
            if spread[1] < FLAT * spread[0]:
                kinds[k] = PlaceStatus.LINE
    return kinds[which.reshape(-1)]


def roll_pitch_yaw(R: Float[np.ndarray, "t 3 3"]) -> Float[np.ndarray, "t 3"]:
    """Roll, pitch, yaw of Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    return np.stack([np.arctan2(R[:, 2, 1], R[:, 2, 2]), pitch, np.arctan2(R[:, 1, 0], R[:, 0, 0])], axis=1)


def _errors(
    q: Float[np.ndarray, "t m 3"],
    p: Float[np.ndarray, "t m 3"],
    arm: Float[np.ndarray, "t 3"],
    angles: Float[np.ndarray, "t 3"],
    w: Float[np.ndarray, "t m"],
    marker: Float[np.ndarray, "t m 3 3"],
) -> tuple[Float[np.ndarray, "t 3"], Float[np.ndarray, "t 3"]]:
    r"""Standard errors of position [m] and angles [rad].

    With q_i = R (b_i - mean b) and p_i from their mean, errors e_i rotate the body by $\theta = G^{-1} \sum q_i \times
    e_i$ (world frame), $G = \sum (q_i \cdot p_i) 1 - p_i q_i^T$, and move its origin by $\bar e - \theta \times R
    \bar b$.
    """
    s = np.einsum("tmi,tmj->tij", p, q)
    s = (s + s.transpose(0, 2, 1)) / 2
    G = np.trace(s, axis1=1, axis2=2)[:, None, None] * np.eye(3) - s
    turn = inverse(G)[:, None] @ _cross(q)
    shift = (w / w.sum(axis=1, keepdims=True))[..., None, None] * np.eye(3) + _cross(arm)[:, None] @ turn
    (_, cp, cy), (_, sp, sy) = np.cos(angles).T, np.sin(angles).T
    with np.errstate(divide="ignore", invalid="ignore"):
        by_turn = np.array([[cy / cp, sy / cp, 0 * cp], [-sy, cy, 0 * cp], [cy * sp / cp, sy * sp / cp, 1 + 0 * cp]])
    turned = by_turn.transpose(2, 0, 1)[:, None] @ turn
    place, angle = (np.einsum("tmij,tmjk,tmik->ti", J, marker, J) for J in (shift, turned))
    return np.sqrt(place), np.sqrt(angle)


def _cross(x: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Matrices [x] with [x] y = x x y."""
    out = np.zeros((*x.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    return out - np.swapaxes(out, -1, -2)
