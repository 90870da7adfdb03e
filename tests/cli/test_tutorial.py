"""`nectosome tutorial`: folders with a page and its files, over nothing that is there. `tests/docs` runs them."""

from pathlib import Path

import pytest

from nectosome.cli.tutorial import tutorial_pages

NEEDED = {
    "model": {"body.yaml", "swimmer.yaml"},
    "simulate": {"swimmer.yaml", "best.py"},
    "turning": {"soften.py", "straight.py"},
    "identify": {"bench.yaml", "campaign.yaml", "f0.5_A20.csv", "f1.1_A30.csv", "f1.4_A30.csv", "f2.0_A40.csv"},
    "design": {"swimmer.yaml"},
    "control": {"swimmer.yaml"},
    "rig": {"simulated.yaml", "rig.yaml", "plan.yaml"},
}


def test_all_are_listed_in_their_order(nectosome):
    answer = nectosome("tutorial")
    assert (answer.code, answer.err) == (0, "")
    assert [line.split()[:2] for line in answer.out.splitlines()[1:]] == [
        [name, f"{number}."] for number, name in enumerate(tutorial_pages(), 1)
    ]


@pytest.mark.parametrize("name", NEEDED)
def test_a_tutorial_is_a_folder_with_its_page_its_files_and_their_schemas(nectosome, name):
    answer = nectosome("tutorial", name)
    assert (answer.code, answer.out) == (0, "")
    assert answer.err.endswith(f"Read {name}/{name}.md; its commands run in that folder.\n")
    there = {path.name for path in Path(name).iterdir()}
    assert {file for file in there if not file.endswith(".schema.json")} == {f"{name}.md", *NEEDED[name]}
    for file in Path(name).glob("*.yaml"):
        first = file.read_text().splitlines()[0]
        assert first.startswith("# yaml-language-server: $schema=")
        assert first.partition("=")[2] in there


def test_a_file_that_was_changed_is_not_overwritten(nectosome):
    assert nectosome("tutorial", "design", "mine").code == 0
    assert nectosome("tutorial", "design", "mine").code == 0  # all is as it was
    swimmer = Path("mine/swimmer.yaml")
    own = swimmer.read_text() + "# mine\n"
    swimmer.write_text(own)
    answer = nectosome("tutorial", "simulate", "mine")
    said = "mine/swimmer.yaml: exists. Give another name, or --force to overwrite it.\n"
    assert (answer.code, answer.err) == (2, said)
    assert swimmer.read_text() == own
    assert not Path("mine/best.py").exists()
    assert nectosome("tutorial", "simulate", "mine", "--force").code == 0
    assert swimmer.read_text() != own


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["simulat"], 'there is no tutorial called "simulat". Did you mean "simulate"?'),
        (["rig", "none/rig"], "FOLDER: cannot make the folder none/rig: No such file or directory."),
        (["rig", "bad\0name"], "FOLDER: cannot make the folder bad name: embedded null byte."),
        (["rig", "file"], "FOLDER: cannot make the folder file: File exists."),
    ],
)
def test_what_is_not_written_is_told(nectosome, argv, said):
    Path("file").write_text("mine")
    answer = nectosome("tutorial", *argv)
    assert (answer.code, answer.out, answer.err) == (2, "", said + "\n")
    assert [path.name for path in Path().iterdir()] == ["file"]
