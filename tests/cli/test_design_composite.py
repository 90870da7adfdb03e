"""`design composite`: the core of a soft rod, with the paper's numbers, and what it refuses."""

import json

import pytest

from .answers import check_wrong

MADE_OF = ("design", "composite", "--core", "17MPa", "--shell", "592kPa")  # Ninjaflex, Dragon Skin 50


def test_the_papers_numbers_come_out_both_ways(nectosome):
    """0.803 and 0.869 for the wanted 7.4 MPa of Table III; 7.66 and 4.92 MPa of the printed ratio of 0.81."""
    wanted, given = (
        json.loads(nectosome(*MADE_OF, *how, "--json").out)["tables"]["rules"]
        for how in (("--young", "7.4MPa"), ("--ratio", "0.81"))
    )
    assert [wanted[rule]["ratio"]["value"] for rule in ("EJ", "EJV")] == pytest.approx([0.8026, 0.8693], abs=1e-4)
    assert [given[rule]["young"]["value"] for rule in ("EJ", "EJV")] == pytest.approx([7.66e6, 4.92e6], rel=1e-3)


def test_what_is_wrong_is_told_in_one_sentence(nectosome, tmp_path):
    both = ("--young", "7MPa", "--ratio", "0.8")
    each = ((), both, ("--young", "1GPa"), ("--young", "7 N"), ("--ratio", "1.2"), ("--ratio", "half"))
    cases = [MADE_OF[:4], (*MADE_OF[:4], "--shell", "0 Pa", "--ratio", "1"), *((*MADE_OF, *how) for how in each)]
    check_wrong(nectosome, cases, tmp_path)
