"""Lens, flat port and camera: which ray in the water a pixel looks along, and which pixel a point is seen in.

World: z up, metres. Pixels: u to the right, v down, the origin at the centre of the first pixel, which therefore covers
-0.5 to 0.5; an image of w by h pixels covers -0.5 to w - 0.5 and -0.5 to h - 0.5.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

Vector = tuple[float, float, float]

_ROUNDING = 1e-9  # px: a ray of the border comes back as near
_LEAST = 1e-8  # spread below which tan(s theta) / s is theta to rounding; smaller ones lose digits


@dataclass(frozen=True)
class RenderLens:
    r"""A lens that is round about its axis, by one number from rectilinear to equidistant.

    $$ r = \frac{f}{s} \tan(s \theta) $$

    at an angle theta from the axis: s = 1 is rectilinear (a pinhole, no distortion), s = 1/2 stereographic
    (r = 2 f tan(theta / 2)), s = 0 its limit, equidistant (r = f theta); the smaller s, the more of a barrel.
    """

    focal: float  # f [px]
    spread: float = 1.0  # s [-], 0 to 1
    centre: tuple[float, float] = (0.0, 0.0)  # of the axis, from the middle of the image: right, down [px]

    def __post_init__(self):
        if self.focal <= 0:
            raise ValueError(f"Lens.focal is {self.focal:g} px; it must be above 0.")
        if not 0 <= self.spread <= 1:
            raise ValueError(f"Lens.spread is {self.spread:g}; 1 is rectilinear, 0.5 stereographic, 0 equidistant.")

    def radius(self, angle: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Distance from the axis in the image [px] of what is at an angle to it [rad]; nan beyond the lens's reach."""
        s = self.spread if self.spread > _LEAST else 0.0
        reach = np.pi / 2 / s if s > 0.5 else np.pi  # of stereographic and wider lenses: all but straight behind
        inside = np.where(angle < reach, angle, np.nan)
        return self.focal * (np.tan(s * inside) / s if s else inside)

    def angle(self, radius: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """The inverse of `radius` [rad]; nan beyond what the lens can image."""
        s = self.spread if self.spread > _LEAST else 0.0
        angle = np.arctan(s * radius / self.focal) / s if s else radius / self.focal
        return np.where(angle < np.pi, angle, np.nan)


@dataclass(frozen=True)
class Port:
    r"""A flat pane with air on the camera's side and water on the other, or, of no thickness, a free water surface.

    Snell in vector form, for a unit ray d that meets a face of unit normal n, c = d . n > 0, with k = n_1 / n_2:

    $$ d' = k d + (\sqrt{1 - k^2 (1 - c^2)} - k c)\, n $$

    A pane shifts a ray sideways. The normal may point either way.
    """

    point: Vector  # on the face towards the air [m]
    normal: Vector
    thickness: float = 0.0  # [m]
    air: float = 1.0  # refractive indices [-]
    glass: float = 1.5
    water: float = 1.333

    def __post_init__(self):
        if self.thickness < 0:
            raise ValueError(f"Port.thickness is {self.thickness:g} m; 0 is a free surface, a pane is thicker.")
        if self.air > min(self.glass, self.water):  # else rays could be reflected totally
            raise ValueError(
                f"Port: the camera's side must be the thinnest medium, but its index is {self.air:g} "
                f"before glass {self.glass:g} and water {self.water:g}."
            )

    def refracted(
        self, place: Float[np.ndarray, "3"], rays: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
        """Where unit rays from a place in the air leave the pane [m], and their unit directions in the water.

        World frame. Rays that never reach the pane are nan.
        """
        n, gap = self.facing(place)
        along = rays @ n
        along = np.where(along > 0, along, np.nan)[:, None]
        at = place + rays * (gap / along)
        if not self.thickness:
            return at, _refracted(rays, n, self.air / self.water)
        rays = _refracted(rays, n, self.air / self.glass)
        at = at + rays * (self.thickness / (rays @ n))[:, None]
        return at, _refracted(rays, n, self.glass / self.water)

    def directions_to(
        self, points: Float[np.ndarray, "n 3"], place: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "n 3"]:
        r"""Directions in the air (not unit) in which a camera at a place sees points in the water.

        In the plane of incidence, with x the tangent of the angle in the air, a point at a distance b behind the pane
        and L to the side of a camera at a distance a before it obeys

        $$ a x + T \tan\theta_g + b \tan\theta_w = L, \quad \tan\theta_i = x / \sqrt{m_i^2 + (m_i^2 - 1) x^2} $$

        with m_i the index over that of the air. The left side rises with x and is concave, so that Newton's steps from
        x = L / (a + T + b), where it is below L, rise to the root and never pass it. Points that are not in the water
        are nan.
        """
        n, gap = self.facing(place)
        away = points - place
        ahead = away @ n
        side = away - ahead[:, None] * n
        L = np.linalg.norm(side, axis=1)
        b = ahead - gap - self.thickness
        b = np.where(b >= 0, b, np.nan)
        x = L / (gap + self.thickness + b)
        for _ in range(100):
            residual, rate = gap * x - L, gap
            for length, m in ((self.thickness, self.glass / self.air), (b, self.water / self.air)):
                q = m * m + (m * m - 1) * x * x
                residual = residual + length * x / np.sqrt(q)
                rate = rate + length * m * m / q**1.5
            step = residual / rate
            x = x - step
            if not np.any(np.abs(step) > 1e-15 * x):
                break
        with np.errstate(invalid="ignore"):
            return n + side * np.where(L > 0, x / L, 0.0)[:, None] + 0 * b[:, None]

    def facing(self, place: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], float]:
        """The unit normal away from a camera at a place, and how far before the pane that is [m]."""
        n = np.asarray(self.normal, float)
        n = n / np.linalg.norm(n)
        gap = float((np.asarray(self.point) - place) @ n)
        if gap == 0:
            raise ValueError("Port: the camera is in the pane; it must be before it, in the air.")
        return (n, gap) if gap > 0 else (-n, -gap)


def _refracted(
    rays: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, "3"], ratio: float
) -> Float[np.ndarray, "n 3"]:
    """Snell in vector form; `ratio` is the index before over that behind."""
    c = rays @ normal
    left = 1 - ratio**2 * (1 - c**2)
    assert not np.any(left < 0), "total reflection: rays came from the dense side"
    return ratio * rays + (np.sqrt(left) - ratio * c)[:, None] * normal


@dataclass(frozen=True)
class RenderCamera:
    """A camera at a place that looks at a point, through a port if there is one.

    Its axes: forward along the lens's axis, right = forward x up, down = forward x right. One that looks straight down
    needs an `up` of its own, such as +y, which then is upwards in the image.
    """

    size: tuple[int, int]  # width, height [px]
    lens: RenderLens
    place: Vector  # of the centre of projection [m]
    towards: Vector  # a point on the lens's axis, as if there were no port [m]
    up: Vector = (0.0, 0.0, 1.0)
    port: Port | None = None

    @cached_property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Unit right, down and forward in the world, row by row."""
        forward = np.asarray(self.towards, float) - self.place
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        length = np.linalg.norm(right)
        if length < 1e-9:
            raise ValueError("Camera.up is along the line of sight; give another, such as (0, 1, 0) when looking down.")
        right = right / length
        return np.stack([right, np.cross(forward, right), forward])

    @cached_property
    def axis(self) -> Float[np.ndarray, "2"]:
        """Pixel of the lens's axis."""
        return (np.asarray(self.size) - 1) / 2 + self.lens.centre

    def rays(self, pixels: Float[np.ndarray, "n 2"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
        """Origins [m] and unit directions, in the world and in the water, of the rays that pixels look along.

        A ray begins where it leaves the port. Of pixels that look past the port or beyond the lens's reach it is nan.
        """
        image = np.asarray(pixels, float) - self.axis
        radius = np.hypot(*image.T)
        angle = self.lens.angle(radius)
        with np.errstate(invalid="ignore"):
            across = np.where(radius > 0, np.sin(angle) / radius, 0.0)[:, None] * image
        # summed rather than a matrix product, whose rounding depends on how many rays there are
        right, down, forward = self.axes
        directions = across[:, :1] * right + across[:, 1:] * down + np.cos(angle)[:, None] * forward
        place = np.asarray(self.place, float)
        if self.port is None:
            return np.broadcast_to(place, directions.shape), directions
        return self.port.refracted(place, directions)

    def project(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Pixels in which points in the world [m] would be seen if the image had no end; nan behind the camera."""
        points, place = np.asarray(points, float), np.asarray(self.place, float)
        away = points - place if self.port is None else self.port.directions_to(points, place)
        x, y, z = self.axes @ away.T
        side = np.hypot(x, y)
        radius = self.lens.radius(np.arctan2(side, z))
        with np.errstate(invalid="ignore"):
            scale = np.where(side > 0, radius / side, 0.0 * radius)
        return self.axis + np.stack([x, y], axis=-1) * scale[:, None]

    def sees(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Pixels in which points in the world [m] are seen; nan for what is behind the camera or outside the image."""
        pixels = self.project(points)
        least, most = -0.5 - _ROUNDING, np.asarray(self.size) - 0.5 + _ROUNDING
        inside = np.all((pixels >= least) & (pixels <= most), axis=1)
        return np.where(inside[:, None], pixels, np.nan)
