"""Free swimming by a wave of curvature, held against elongated-body theory; the table of the catsharks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.mechanism.rods import legendre
from nectosome.model import build
from nectosome.robots import describe
from nectosome_studies import undulation
from nectosome_studies.catshark.midline import curvature, table, wavelengths, waves

ONE = slice(33, 34)  # catshark 2 at 1.5 L/s
NO_CROSS = "body.loads.cross.normal=0"


REYNOLDS = 2e4


@pytest.fixture(scope="module")
def shark():
    return build(undulation.with_plate_friction(describe("catshark", [NO_CROSS]), REYNOLDS))


def shortened(share: float):
    """Wave of one swim with a share of its amplitude."""
    t = table()
    one = (t.frequency, share * t.head, share * t.tail, wavelengths(t)["points"])
    return waves(12, *(x[ONE] for x in one))  # pyright: ignore[reportArgumentType]


@pytest.mark.slow
def test_a_free_swimmer_keeps_the_speed_at_which_lighthills_thrust_is_its_friction(shark):
    """m/2 mean(h_t^2 - U^2 h_x^2) at the tail = mean of rho pi/2 C_t int r |v| v_x dx along the way: to 2 %.

    At half the amplitude of a real swim; from the places of the stations alone, differentiated by Fourier.
    """
    wave, water = shortened(0.5), np.full(1, 1e-3)
    found = undulation.swims(shark, wave, water)
    friction = 2 * 1.328 / np.sqrt(REYNOLDS)
    together, x = jax.tree.map(lambda x: x[None], (wave[0], shark.initial()))
    x = State(x.q, x.v.at[0, 0].set(-0.16 * found.speed[0]), x.z)
    places = np.asarray(undulation._swim(shark, together, jnp.asarray(water), x))[0, undulation.STEPS :]

    f, body = float(wave[0].frequency), shark.tree.stations
    way = places[-1, 0] - places[0, 0]
    U, along = f * np.linalg.norm(way), way / np.linalg.norm(way)
    time = np.linspace(0, 1, undulation.STEPS + 1)[:-1, None, None]
    periodic = places[:-1] - time * way
    rate = 2j * np.pi * f * np.fft.fftfreq(undulation.STEPS, 1 / undulation.STEPS)[:, None, None]
    v = np.fft.ifft(rate * np.fft.fft(periodic, axis=0), axis=0).real + f * way
    slope = np.gradient(places[:-1], np.asarray(body.x), axis=1, edge_order=2)
    tangent = slope / np.linalg.norm(slope, axis=-1, keepdims=True)

    across = np.array([-along[1], along[0]])
    h_t, h_x = v[:, -1] @ across, -(tangent[:, -1] @ across) / (tangent[:, -1] @ along)
    m = 1000 * np.pi * float(body.half_width[-1, 1]) ** 2
    thrust = 0.5 * m * (np.mean(h_t**2) - U**2 * np.mean(h_x**2))
    drag = np.linalg.norm(v, axis=-1) * np.sum(v * tangent, axis=-1) * (tangent @ along)
    area = np.asarray(body.weight * body.half_width.mean(axis=1))
    assert thrust == pytest.approx(0.5 * 1000 * np.pi * friction * np.mean(drag @ area), rel=0.02)


def test_the_curvature_is_that_of_the_midline():
    """Integrated twice from the midline's place and slope at the head it is the midline again."""
    x, w = np.polynomial.legendre.leggauss(80)
    s, w = 0.5 * (x + 1), 0.5 * w
    head, tail, wavelength = (np.array([[y]]) for y in (0.04, 0.2, 0.7))
    c = curvature(s, head, tail, wavelength)[0]
    k = 2 * np.pi / 0.7
    tip = 0.5 * 0.04 - 0.5j * 0.04 * k + np.sum(w * (1 - s) * c)  # y(0) + y'(0) + int (1 - s) y''
    assert tip == pytest.approx(0.5 * 0.2 * np.exp(-1j * k), rel=1e-12)
    made = waves(12, np.array([2.0]), head[0], tail[0], wavelength[0])
    again = legendre(12, s) @ (np.asarray(made[0].cosine) - 1j * np.asarray(made[0].sine))
    assert np.max(np.abs(again - c)) < 1e-4 * np.max(np.abs(c))


def test_the_table_is_that_of_the_authors():
    """Catshark 11 at 1 length a second: 1.953125 Hz, 0.174855 L, 0.224827 m/s over 0.16 m; St by f A L/U."""
    t = table()
    assert (t.specimen.size, t.specimen[33], t.speed_class[33]) == (51, "catshark2", 1.5)
    assert t.speed[0] == pytest.approx(0.2248271 / 0.16, rel=1e-6)
    np.testing.assert_allclose(t.frequency * t.tail / t.speed, t.strouhal, rtol=1e-12)


def test_of_the_printed_waves_most_are_slower_than_the_sharks():
    t = table()
    slow = {name: int(np.sum(t.speed > t.frequency * x)) for name, x in wavelengths(t).items()}
    assert slow == {"points": 25, "full": 40, "half": 12, "metres": 0}
