"""Every case reaches its published or closed-form number."""

import pytest

from .case import Case
from .cases import CASES


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.name}: {case.quantity}")
def test_case(case: Case):
    assert case.compute() == pytest.approx(case.expected, rel=0, abs=case.tolerance)
