import subprocess
import sys

from tests.pages import assert_self_contained

from nectosome.view import show_run


def test_a_single_run_gets_a_page(run, tmp_path):
    show_run(run, tmp_path / "run.html")
    page = (tmp_path / "run.html").read_text(encoding="utf-8")
    assert_self_contained(page)
    assert page.count("<figure>") == 6 and "<h1>made up</h1>" in page and "(-0.5, 0, 0) m/s" in page


def test_a_run_without_drive_or_provenance_gets_a_page(run, tmp_path):
    show_run(run.isel(prescribed=slice(0)).drop_attrs(), tmp_path / "run.html")
    assert (tmp_path / "run.html").exists()


def test_importing_the_room_loads_no_plotting():
    code = "import sys, nectosome.view; sys.exit('plotly' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
