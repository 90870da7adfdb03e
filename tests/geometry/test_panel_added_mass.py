"""Added mass by panels: closed forms, moves and turns of the body, walls, and what is kept."""

import logging

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from tests.geometry import bodies_of_revolution as rings
from tests.geometry import closed_surfaces as made

from nectosome.geometry import panel_added_mass as panels
from nectosome.geometry.panel_added_mass import Boundary, panel_added_mass
from nectosome.geometry.triangles import joined
from nectosome.loads import lamb_coefficients
from nectosome.units import InputError

BALL = made.spheroid(1, 1)
TOUCHING = joined([made.turned(made.box(1, 1, 1), np.eye(3), (x, 0, 0)) for x in (0, 1)])


@pytest.fixture(autouse=True)
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("NECTOSOME_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(scope="module", autouse=True)
def capytaine():
    return pytest.importorskip("capytaine")


def diagonal(found):
    return np.diag(found.matrix), np.diag(found.error)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0, 7.0])
def test_spheroids_of_lamb(ratio):
    surface = made.spheroid(ratio, 1)
    k1, k2, k3 = (float(k) for k in lamb_coefficients(jnp.asarray(ratio)))
    across = k3 * (1 + ratio**2) / 5
    exact = np.array([0, across, across, k1, k2, k2]) * surface.solid.size
    found, error = diagonal(panel_added_mass(surface))
    assert found[1:] == pytest.approx(exact[1:], rel=0.02, abs=2e-4)
    assert found[0] < 1e-4 * surface.solid.size
    assert np.all(np.abs(found - exact) < error + 1e-3 * exact)


def test_ellipsoids_of_three_axes():
    """Lamb (1932), art. 114 and 115: along each axis and turning about it, with his integrals alpha, beta, gamma."""
    axes = np.array([1.0, 0.45, 0.2])
    surface = BALL._replace(vertices=BALL.vertices * axes)
    squares, product = axes**2, axes.prod()

    def integral(square):
        return product * quad(lambda s: 1 / ((square + s) * np.sqrt(np.prod(squares + s))), 0, np.inf)[0]

    k = np.array([integral(square) for square in squares])
    turning = []
    for i in range(3):
        j, l = (i + 1) % 3, (i + 2) % 3
        less, more = squares[j] - squares[l], squares[j] + squares[l]
        turning.append(less**2 * (k[l] - k[j]) / (2 * less + more * (k[j] - k[l])) / 5)
    exact = surface.solid.size * np.array([*turning, *(k / (2 - k))])
    found, error = diagonal(panel_added_mass(surface))
    assert found == pytest.approx(exact, rel=0.02)
    assert np.all(np.abs(found - exact) < error + 2e-3 * exact)


@pytest.mark.parametrize("ratio", [1.0, 7.0])
def test_rings_find_spheroids_of_lamb(ratio):
    """So that they are a measure for other hulls: to the square of a piece's length."""
    t = np.linspace(np.pi, 0, 201)
    r = np.concatenate([[0.0], np.sin(t[1:-1]), [0.0]])
    volume, along, across, about = rings.added_mass_of_revolution(ratio * np.cos(t), r)
    k1, k2, k3 = (float(k) for k in lamb_coefficients(jnp.asarray(ratio)))
    assert volume == pytest.approx(4 / 3 * np.pi * ratio, rel=1e-4)
    assert [along / volume, across / volume] == pytest.approx([k1, k2], rel=1e-4)
    assert about / volume == pytest.approx(k3 * (1 + ratio**2) / 5, rel=2e-4, abs=1e-12)


@pytest.mark.parametrize("hull", [pytest.param(rings.suboff_hull, marks=pytest.mark.slow), rings.remus_hull])
def test_two_published_hulls(hull):
    """Bare hulls of the DARPA SUBOFF and the REMUS 100, beside the equation along their profiles."""
    volume, *exact = rings.added_mass_of_revolution(*hull())
    surface = made.revolved(*hull(100))
    assert surface.solid.size == pytest.approx(volume, rel=2e-3)
    found, error = diagonal(panel_added_mass(surface))
    exact = np.array(exact)[[2, 2, 0, 1, 1]]
    assert found[1:] == pytest.approx(exact, rel=0.02)
    assert np.all(np.abs(found[1:] - exact) < error[1:] + 3e-3 * exact)


def test_polyhedra_by_their_polarizability():
    """A body of permittivity 0 in an even field: -(1 + k) volumes (Sihvola et al. 2004, IEEE Trans. AP 52)."""
    for surface, polarizability in ((made.box(1, 1, 1), -1.6383), (made.octahedron(), -1.5871)):
        found, error = diagonal(panel_added_mass(surface))
        exact = (-polarizability - 1) * surface.solid.size
        assert found[3:] == pytest.approx([exact] * 3, rel=0.02)
        assert np.all(np.abs(found[3:] - exact) < error[3:])


@pytest.mark.slow
def test_the_middle_of_a_long_cylinder_carries_its_own_volume():
    """Of two lengths, so that the water that goes around the ends is the same in both."""
    short, long = made.cylinder(8, 0.5), made.cylinder(16, 0.5)
    masses = [panel_added_mass(one, panels=1600).matrix[3, 3] for one in (short, long)]
    assert masses[1] - masses[0] == pytest.approx(long.solid.size - short.solid.size, rel=0.02)


def rankine_ovoid(strength):
    r"""Surface around a source and a sink of $4\pi$ `strength` at x = -1, 1 in a stream of 1, and its volume.

    Its stream function $r^2/2 - m ((x + 1)/R_1 - (x - 1)/R_2)$ vanishes on it.
    """
    end = brentq(lambda x: (x * x - 1) ** 2 - 4 * strength * x, 1, 9)

    def radius(x):
        def stream(r):
            return r * r - 2 * strength * ((x + 1) / np.hypot(x + 1, r) - (x - 1) / np.hypot(x - 1, r))

        return brentq(stream, 1e-5, 9)

    x = end * np.cos(np.linspace(np.pi, 0, 81))
    radii = np.array([0, *map(radius, x[1:-1]), 0])
    inside = 2 * np.pi * quad(lambda x: radius(x) ** 2, 0, 0.9999 * end)[0]
    return made.revolved(x, radii), inside


@pytest.mark.parametrize("strength", [0.05, *(pytest.param(x, marks=pytest.mark.slow) for x in (0.01, 0.3))])
def test_rankines_ovoids_along_their_axis(strength):
    """Hulls of 5.4, 2.9 and 1.6 diameters. Taylor (1928): the dipole moment of what is inside gives M + V."""
    surface, inside = rankine_ovoid(strength)
    found, _ = diagonal(panel_added_mass(surface))
    assert found[3] / surface.solid.size == pytest.approx(4 * np.pi * 2 * strength / inside - 1, rel=0.02)


def test_about_another_point_a_ball_turns_its_mass_with_it():
    m, (x, y, z) = 0.5 * BALL.solid.size, (0.3, -0.2, 0.5)
    lever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    found = panel_added_mass(BALL, (-x, -y, -z)).matrix
    expected = np.block([[-m * lever @ lever, m * lever], [-m * lever, m * np.eye(3)]])
    assert found == pytest.approx(expected, rel=0.005, abs=2e-3 * m)


def test_moving_the_axes_moves_the_point():
    surface, by = made.box(1, 2, 0.5), (0.4, -0.1, 0.2)
    there = panel_added_mass(made.turned(surface, np.eye(3), by), by).matrix
    assert there == pytest.approx(panel_added_mass(surface).matrix, abs=1e-6)


def test_turning_the_axes_turns_the_matrix():
    """The even triangles are others, so that the two differ within the error that is told."""
    surface, turn = made.box(1, 2, 0.5), Rotation.from_euler("xyz", [0.3, -0.5, 1.1]).as_matrix()
    twist = np.kron(np.eye(2), turn)
    first, second = panel_added_mass(surface), panel_added_mass(made.turned(surface, turn))
    back = twist.T @ second.matrix @ twist
    size = np.sqrt(np.diag(first.matrix))
    assert np.abs(back - first.matrix) / np.outer(size, size) == pytest.approx(0, abs=3e-3)


def test_a_body_of_any_size():
    """Of 4 mm: lengths to the powers 3, 4 and 5."""
    large, size = made.box(1, 2, 0.5), 2e-3
    small = large._replace(vertices=size * large.vertices)
    powers = np.add.outer([1, 1, 1, 0, 0, 0], [1, 1, 1, 0, 0, 0]) + 3
    found = panel_added_mass(small).matrix / size**powers
    assert found == pytest.approx(panel_added_mass(large).matrix, rel=1e-6, abs=1e-6)


def test_the_matrix_is_symmetric_and_no_motion_has_a_negative_energy():
    found = panel_added_mass(made.spheroid(4, 1), (0.1, 0.2, 0.3)).matrix
    assert found == pytest.approx(found.T, rel=1e-12)
    assert np.linalg.eigvalsh(found).min() > -1e-12 * np.abs(found).max()


@pytest.mark.parametrize(("kind", "sign"), [("wall", 1), ("surface", -1)])
def test_a_ball_beside_a_plane(kind, sign):
    """Lamb (1932), art. 137: 1 + 3/8 (a/h)^3 towards a wall at a distance h, 1 + 3/16 (a/h)^3 along it."""
    free = np.diag(panel_added_mass(BALL).matrix)[3:]
    normal = np.array([2.0, -1.0, 2.0]) / 3
    beside = panel_added_mass(BALL, boundary=Boundary(tuple(2.5 * normal), tuple(normal), kind)).matrix[3:, 3:]
    share = beside / free.mean()
    assert normal @ share @ normal == pytest.approx(1 + sign * 3 / 8 / 2.5**3, abs=3e-3)
    along = (np.trace(share) - normal @ share @ normal) / 2
    assert along == pytest.approx(1 + sign * 3 / 16 / 2.5**3, abs=3e-3)


def test_twice_the_way_to_a_wall_is_the_way_to_another_ball():
    """A body and its mirror image, as one surface, move as one along the wall: each carries what one carries there."""
    above, below = made.turned(BALL, np.eye(3), (0, 0, 1.5)), made.turned(BALL, np.eye(3), (0, 0, -1.5))
    both = made.Triangles(
        np.concatenate([above.vertices, below.vertices]),
        np.concatenate([above.faces, below.faces + len(above.vertices)]),
    )
    wall = panel_added_mass(above, boundary=Boundary((0, 0, 0), (0, 0, -1), "wall"), panels=500).matrix
    assert panel_added_mass(both, panels=1000).matrix[3, 3] == pytest.approx(2 * wall[3, 3], rel=4e-3)


@pytest.mark.parametrize("thickness", [0.02, 0.005, *(pytest.param(x, marks=pytest.mark.slow) for x in (0.03, 0.01))])
def test_the_error_of_a_disc_thinner_than_half_a_panel_holds_what_it_is_without_thickness(thickness):
    """At least 8/3 across and 16/45 turning (Lamb, art. 102, 108), for its 48 corners 0.3 % and 0.6 % less."""
    disc = made.cylinder(thickness, 1.0)
    found, error = diagonal(panel_added_mass(disc))
    assert found[5] + error[5] > 8 / 3 > found[5] - error[5]
    assert found[0] + error[0] > 16 / 45 > found[0] - error[0]
    own = disc.solid.size, disc.surface.size
    assert panels.panels_for(*own) > 1000
    assert panels.panels_for(20 * own[0], own[1]) < 1000


@pytest.mark.parametrize(("change", "said"), [
    ({"panels": 50}, "50 panels: 100 to 5000"),
    ({"boundary": Boundary((0, 0, 0.9), (0, 0, 1), "surface")}, "reaches 0.1 m through the surface"),
    ({"panels": 100, "boundary": Boundary((0, 0, 1.001), (0, 0, 1), "wall")}, "Use more panels"),
    ({"triangles": BALL._replace(faces=BALL.faces[:, ::-1])}, "face inwards"),
    ({"triangles": TOUCHING, "panels": 100}, "bodies touch or overlap, or faces.*Unite the bodies"),
])  # fmt: skip
def test_what_cannot_be_computed(change, said):
    with pytest.raises(InputError, match=said):
        panel_added_mass(**{"triangles": BALL} | change)


def test_panels_at_one_place_give_no_numbers(monkeypatch):
    """The package raises an error of its own, or what it gives is NaN."""
    monkeypatch.setattr(panels, "any_touch", lambda bodies: False)
    fine = made.of(trimesh.creation.box((1, 1, 1)).subdivide().apply_translation([1, 0, 0]))
    with pytest.raises(InputError, match="faces lie on one another"):
        panel_added_mass(joined([made.box(1, 1, 1), fine]))


def test_results_are_kept_and_damaged_ones_are_computed_anew(fresh_cache, monkeypatch):
    first = panel_added_mass(BALL, panels=200)
    (file,) = (fresh_cache / "added_mass").iterdir()
    computed = []
    original = panels._added_mass
    monkeypatch.setattr(panels, "_added_mass", lambda *a: computed.append(1) or original(*a))
    again = panel_added_mass(BALL, panels=200)
    assert not computed and np.array_equal(again.matrix, first.matrix) and np.array_equal(again.error, first.error)
    for damage in (file.read_bytes()[:-1], b"", bytes([file.read_bytes()[40] ^ 1]).join([b""] * 2)):
        file.write_bytes(damage)
        computed.clear()
        assert np.array_equal(panel_added_mass(BALL, panels=200).matrix, first.matrix) and len(computed) == 2
    panel_added_mass(BALL, panels=220)
    assert len(list((fresh_cache / "added_mass").iterdir())) == 2
    monkeypatch.setenv("NECTOSOME_CACHE", "")
    computed.clear()
    panel_added_mass(BALL, panels=200)
    assert len(computed) == 2


def test_the_package_leaves_the_logs_of_the_program_alone():
    handlers = logging.root.handlers[:]
    panels._capytaine.cache_clear()
    panels._capytaine()
    assert logging.root.handlers == handlers
