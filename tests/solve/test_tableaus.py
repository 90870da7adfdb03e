"""The coefficients fulfil the order conditions of Butcher's rooted trees, and what else is claimed of the methods."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from nectosome.solve.runge_kutta import ESDIRK4, GAMMA, TSIT5


def trees(order):
    """Rooted trees with `order` nodes, each a sorted tuple of its branches."""
    if order == 1:
        return [()]
    smaller = [(n, tree) for n in range(1, order) for tree in trees(n)]
    return [
        tuple(tree for _, tree in branches)
        for k in range(1, order)
        for branches in combinations_with_replacement(smaller, k)
        if sum(n for n, _ in branches) == order - 1
    ]


def nodes(tree):
    return 1 + sum(nodes(branch) for branch in tree)


def density(tree):
    return nodes(tree) * np.prod([density(branch) for branch in tree])


def stages(tree, A):
    """Elementary weight of each stage."""
    return np.prod([A @ stages(branch, A) for branch in tree], axis=0) if tree else np.ones(len(A))


def conditions(b, A, order):
    return [b @ stages(tree, A) - 1 / density(tree) for n in range(1, order + 1) for tree in trees(n)]


def test_there_are_as_many_trees_as_butcher_counts():
    assert [len(trees(n)) for n in range(1, 6)] == [1, 1, 2, 4, 9]


@pytest.mark.parametrize(("method", "order"), [(ESDIRK4, 4), (TSIT5, 5)], ids=["ESDIRK4", "TSIT5"])
def test_order_conditions(method, order):
    b = method.A[-1]
    assert method.order == order
    assert np.max(np.abs(conditions(b, method.A, order))) < 1e-13
    assert np.max(np.abs(conditions(b, method.A, order + 1))) > 1e-5


@pytest.mark.parametrize(("method", "order"), [(ESDIRK4, 3), (TSIT5, 4)], ids=["ESDIRK4", "TSIT5"])
def test_the_embedded_solution_is_one_order_lower(method, order):
    embedded = method.A[-1] - method.error
    assert np.max(np.abs(conditions(embedded, method.A, order))) < 1e-13
    assert np.max(np.abs(conditions(embedded, method.A, order + 1))) > 1e-5


@pytest.mark.parametrize("method", [ESDIRK4, TSIT5], ids=["ESDIRK4", "TSIT5"])
def test_rows_sum_to_the_nodes_and_the_last_stage_is_the_solution(method):
    np.testing.assert_allclose(method.A.sum(axis=1), method.c, atol=1e-14)
    assert method.c[-1] == 1
    assert np.all(np.triu(method.A, 1) == 0)


def test_the_implicit_method_is_singly_diagonal_and_l_stable():
    diagonal = np.diag(ESDIRK4.A)
    assert diagonal[0] == 0
    assert np.all(diagonal[1:] == GAMMA)

    def growth(z):
        eye = np.eye(6)
        return 1 + z * ESDIRK4.A[-1] @ np.linalg.solve(eye - z * ESDIRK4.A, np.ones(6))

    assert abs(growth(-1e7)) < 1e-6
    assert max(abs(growth(1j * y)) for y in np.logspace(-2, 6, 200)) <= 1 + 1e-12


def test_the_explicit_method_takes_its_last_rate_as_the_next_first():
    assert np.all(np.diag(TSIT5.A) == 0)
    assert TSIT5.A[-1, -1] == 0
