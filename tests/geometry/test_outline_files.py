"""Outlines from SVG and DXF files: sizes, units, curves, and a sentence for what is no outline."""

import numpy as np
import pytest

from nectosome.geometry.outline_files import MOST_BYTES, read_outline
from nectosome.units import InputError

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("svgelements")
MM = 'width="100mm" height="50mm" viewBox="0 0 100 50"'


@pytest.fixture
def svg(tmp_path):
    def write(body: str, head: str = MM):
        path = tmp_path / "fin.svg"
        path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>')
        return path

    return write


@pytest.fixture
def dxf(tmp_path):
    def write(draw, units: int = 4):
        document = ezdxf.new("R2010")
        document.header["$INSUNITS"] = units
        draw(document.modelspace())
        path = tmp_path / "fin.dxf"
        document.saveas(path)
        return path

    return write


def refusal(path, **options) -> str:
    with pytest.raises(InputError) as found:
        read_outline(path, **options)
    return str(found.value)


def area(points: np.ndarray) -> float:
    x, y = points.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def rows(points: np.ndarray) -> set[tuple[float, ...]]:
    return {tuple(point) for point in points.round(9).tolist()}


RECTANGLE = {(0.0, 0.0), (0.04, 0.0), (0.04, -0.01), (0.0, -0.01)}


@pytest.mark.parametrize(
    ("head", "body", "unit"),
    [
        (MM, '<rect width="40" height="10"/>', None),
        (MM, '<path d="M0 0h40v10H0z"/>', None),
        (MM, '<g transform="translate(40 10) scale(2)"><polygon points="0,0 -20,0 -20,-5 0,-5"/></g>', None),
        (MM, '<g transform="rotate(90)"><rect width="10" height="40" transform="translate(0 -40)"/></g>', None),
        (MM, '<path d="M0 0 L 40 0"/><path d="M 0 10 L 40 10"/><path d="M40 0 v10 M 0 0 v 10"/>', None),
        ('width="10cm" height="5cm" viewBox="0 0 1000 500"', '<rect width="400" height="100"/>', None),
        ('width="4in" height="2in" viewBox="0 0 101.6 50.8"', '<rect width="40" height="10"/>', "mm"),
        ('viewBox="0 0 100 50"', '<rect width="4" height="1"/>', "cm"),
        ('width="500" height="250" viewBox="-5 -5 10 5"', '<rect width="4" height="1"/>', "cm"),
        ('width="100mm" height="50mm"', f'<rect width="{40 * 96 / 25.4}" height="{10 * 96 / 25.4}"/>', None),
        ("", '<rect width="40" height="10"/>', "mm"),
    ],
)
def test_an_svg_file_gives_its_outline_in_metres_y_up(svg, head: str, body: str, unit: str | None):
    assert rows(read_outline(svg(body, head), unit=unit)) == RECTANGLE


@pytest.mark.parametrize(
    "ellipse",
    [
        '<ellipse cx="40" cy="10" rx="40" ry="10"/>',
        '<g transform="translate(40 10) rotate(180)"><ellipse rx="40" ry="10"/></g>',
        '<path d="M 0 10 A 40 10 0 0 1 80 10 A 40 10 0 0 1 0 10 Z"/>',
    ],
)
def test_an_ellipse_of_an_svg_file_is_as_exact_as_its_tolerance(svg, ellipse: str):
    """All corners are on it; the lines' area is less than the ellipse's by 2/3 of tolerance times girth at most."""
    for tolerance in (1e-3, 1e-4, 1e-5):
        points = read_outline(svg(ellipse), tolerance=tolerance, origin=(0.0, 0.01))
        x, y = points.T
        np.testing.assert_allclose(((x - 0.04) / 0.04) ** 2 + (y / 0.01) ** 2, 1.0, atol=1e-6)
        missing = np.pi * 0.04 * 0.01 - abs(area(points))
        assert 0 < missing < 2 / 3 * tolerance * 0.1717  # girth by Ramanujan's formula [m]


def test_bezier_curves_stay_within_the_tolerance(svg):
    """The quadratic one y = x^2 between 0 and 40 mm, in these units, is met at its corners; chords are inside of it."""
    path = svg('<path d="M 0 0 Q 20 0 40 -40 L 0 -40 Z"/><path id="c" d="M 0 0 C 0 20 40 20 40 0 Z"/>')
    assert "has 2 closed lines" in refusal(path)
    x, y = read_outline(path, name="c", tolerance=1e-4).T
    # x = 40 (3 t^2 - 2 t^3), y = -60 t (1 - t): its area is 3/5 40 20 mm2
    assert abs(area(np.stack([x, y], axis=1))) == pytest.approx(3 / 5 * 0.04 * 0.02, rel=2e-2)
    finest = abs(area(read_outline(path, name="c", tolerance=2e-6)))
    assert finest == pytest.approx(3 / 5 * 0.04 * 0.02, rel=2e-4)


@pytest.mark.parametrize(("units", "metre"), [(1, 0.0254), (4, 1e-3), (5, 1e-2), (6, 1.0)])
def test_a_dxf_file_says_its_unit(dxf, units: int, metre: float):
    path = dxf(lambda space: space.add_lwpolyline([(0, 0), (4, 0), (4, 1), (0, 1)], close=True), units)
    assert rows(read_outline(path) / metre) == {(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (0.0, 1.0)}


def test_a_dxf_file_without_a_unit_needs_one_and_another_one_is_refused(dxf):
    def draw(space):
        space.add_lwpolyline([(0, 0), (4, 0), (4, 1)], close=True)

    assert "does not say its unit. Give it as unit: mm" in refusal(dxf(draw, 0))
    assert area(read_outline(dxf(draw, 0), unit="cm")) == pytest.approx(2e-4, rel=1e-12)
    assert "says itself that its unit is the in, not the mm" in refusal(dxf(draw, 1), unit="mm")


def test_lines_arcs_and_splines_of_a_dxf_file_join_into_one_outline(dxf):
    """A half disc of radius 10 mm on a box of 20 mm by 5 mm: drawn in any order and direction."""

    def draw(space):
        space.add_arc((0, 0), 10, 0, 180)
        space.add_line((-10, -5), (10, -5))
        space.add_line((10, 0), (10, -5))
        space.add_line((-10, -5), (-10, 0))

    whole = np.pi * 0.01**2 / 2 + 0.02 * 0.005
    assert abs(area(read_outline(dxf(draw), tolerance=1e-6))) == pytest.approx(whole, rel=1e-4)

    def bulge(space):  # two half circles
        space.add_lwpolyline([(0, 0, 0, 0, 1), (10, 0, 0, 0, 1)], close=True)

    assert abs(area(read_outline(dxf(bulge), tolerance=1e-6))) == pytest.approx(np.pi * 0.005**2, rel=5e-4)

    def parabola(space):  # a quadratic spline, y = x^2/40 from -20 to 20 mm, and its chord
        space.add_spline(degree=2).control_points = [(-20, 10), (0, -10), (20, 10)]
        space.add_line((-20, 10), (20, 10))

    points = read_outline(dxf(parabola), tolerance=1e-6)
    assert abs(area(points)) == pytest.approx(2 / 3 * 0.04 * 0.01, rel=2e-4)

    def ellipse(space):
        space.add_ellipse((0, 0), (40, 0), 0.25)

    points = read_outline(dxf(ellipse), tolerance=1e-6)
    assert abs(area(points)) == pytest.approx(np.pi * 0.04 * 0.01, rel=5e-4)


def test_one_of_several_lines_is_named_by_its_layer_or_id(dxf, svg):
    def draw(space):
        space.add_lwpolyline([(0, 0), (10, 0), (10, 5)], close=True, dxfattribs={"layer": "FIN"})
        space.add_circle((8, 2), 1, dxfattribs={"layer": "hole"})

    assert "has 2 closed lines, where one is expected (layer: FIN, hole)" in refusal(dxf(draw))
    assert 'has no line with the layer "tail". There are: FIN, hole.' in refusal(dxf(draw), name="tail")
    assert area(read_outline(dxf(draw), name="FIN")) == pytest.approx(2.5e-5, rel=1e-12)
    lines = '<path id="a" d="M0 0h9v4z"/><path id="b" d="M0 0h10v-5z"/>'
    assert "has 2 closed lines, where one is expected (id: a, b)" in refusal(svg(lines))
    assert area(read_outline(svg(lines), name="b")) == pytest.approx(2.5e-5, rel=1e-12)


def test_a_line_of_an_svg_file_has_its_label_and_its_id(svg):
    label = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" inkscape:label="tail fin"'
    path = svg(f'<path id="p1" {label} d="M0 0h9v4z"/><g id="p3"><path d="M0 0h10v-5z"/></g>')
    for name in ("tail fin", "p1"):
        assert area(read_outline(path, name=name)) == pytest.approx(-1.8e-5, rel=1e-12)
    assert "There are: tail fin, (none)." in refusal(path, name="p2")


def test_a_tolerance_larger_than_the_curves_still_gives_an_outline_of_them(dxf):
    points = read_outline(dxf(lambda space: space.add_circle((0, 0), 10)), tolerance=1.0)
    assert 0.97 * np.pi < 1e4 * abs(area(points)) < np.pi


def test_a_hole_is_refused(svg):
    assert "A plate has no holes" in refusal(svg('<path d="M0 0h40v10H0z M5 2h5v5H5z"/>'))


def test_an_outline_away_from_the_origin_needs_to_be_told_where_its_root_is(svg):
    path = svg('<rect x="30" y="20" width="40" height="10"/>')
    assert "from 30 mm to 70 mm along x and 20 mm to 30 mm along y" in refusal(path)
    assert rows(read_outline(path, origin=(0.03, 0.02))) == RECTANGLE


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.svg", b"", "this is not XML: no element found, in line 1."),
        ("a.svg", bytes(range(256)), "this is no SVG: it is not text in UTF-8."),
        ("a.svg", b"<html/>", "this is no SVG: its outermost element is another one."),
        ("a.svg", b"<svg><path d='M0 0L9 9'", "this is not XML: unclosed token, in line 1."),
        ("a.svg", b"<!DOCTYPE a [<!ENTITY b 'c'>]><svg>&b;</svg>", "declares entities, which are not read."),
        ("a.svg", b"<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]><svg>&b;</svg>", "declares entities"),
        ("a.svg", b"<svg><rect id='a'/><use href='#a'/></svg>", "has clones (<use>), which are not read."),
        ("a.svg", b"<svg><text>a</text></svg>", "has no lines."),
        ("a.svg", b"<svg><path id='p' d='M0 0 L9 0 L x 3 Z'/></svg>", 'with the id "p" has "x" in its coordinates'),
        ("a.svg", b"<svg><path id='p' d='M0 0 L9 0 L9 9 5 Z'/></svg>", 'with the id "p" has 3 numbers after "L"'),
        ("a.svg", b"<svg><path d='M0 0L1e400 0L3 3Z'/></svg>", "has places beyond 10 km. Check its unit."),
        ("a.svg", b"<svg><path style='transform: scale(2)' d='M0 0L9 0L9 9Z'/></svg>", "has transforms in styles"),
        ("a.svg", b"<svg><path d='M0 0L1e-9 0L0 1e-9Z'/></svg>", "is smaller than 0.01 um. Check its unit."),
        ("a.svg", b"<svg><path d='M0 0L9 0L9 9'/></svg>", "has an open line, from (0, 0) to (9, 9) in its own units."),
        ("a.svg", b"<svg><path d='M0 0L9 9L9 0L0 9Z'/></svg>", "crosses or touches itself"),
        ("a.svg", b" " * (MOST_BYTES + 1), "larger than 2 MB, which is too large."),
        ("a.svg", b"<svg>" + b"<rect width='1' height='1'/>" * 3000 + b"</svg>", "has 3000 lines, at most 2000"),
        ("a.dxf", b"", "this is no DXF file: it has no sections."),
        ("a.dxf", b"AutoCAD Binary DXF\r\n\x1a\0" + bytes(99), "is a binary DXF file. Save it as text."),
        ("a.dxf", bytes(range(256)), "this is no DXF file: it has no sections."),
        ("a.dxf", b"  0\nSECTION\n  2\nENTITIES\n  0\nLINE\n", "this DXF file cannot be read"),
        ("a.pdf", b"%PDF", 'is no drawing by its ending: ".pdf". An .svg or .dxf file is read.'),
    ],
)
def test_a_bad_file_is_told_in_a_sentence(tmp_path, name: str, content: bytes, says: str):
    path = tmp_path / name
    path.write_bytes(content)
    told = refusal(path, unit="mm")
    assert told.startswith(f"{path}: ") and says in told


def test_a_drawing_with_too_many_points_and_one_in_space_are_refused(svg, dxf):
    zigzag = " ".join(f"L {k / 10} {k % 2 + 1}" for k in range(1, 900))
    assert "needs 901 points" in refusal(svg(f'<path d="M 0 9 {zigzag} L 89.9 9 Z"/>'), tolerance=1e-3)
    assert "has a line on layer 0 that leaves the x-y plane" in refusal(dxf(lambda s: s.add_line((0, 0, 0), (9, 0, 4))))


def test_a_long_line_is_refused_before_it_is_worked_out(svg):
    path = svg('<path d="M 0 0 ' + " ".join(f"L {k % 97} {k % 89}" for k in range(240_000)) + ' Z"/>')
    assert path.stat().st_size > 0.9 * MOST_BYTES
    assert "has more than 40000 coordinates" in refusal(path)
