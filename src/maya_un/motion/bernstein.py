"""Polynomials on [0, 1] in Bernstein form, and a proof that one stays above zero.

A polynomial p(t) = Σ wᵢ tⁱ(1−t)ⁿ⁻ⁱ is kept by its scaled coefficients wᵢ = C(n, i)·βᵢ, because then a product of
polynomials is the plain convolution of their coefficients. On [0, 1] every value of p lies between the
least and the greatest βᵢ, and β₀ = p(0), βₙ = p(1): coefficients that are all positive prove the whole
polynomial positive, and halving the interval (de Casteljau) makes the bound as tight as needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import comb

Polynomial = Sequence[float]
"""Scaled Bernstein coefficients wᵢ, i = 0 … degree."""

_BINOMIALS = tuple(tuple(float(comb(n, i)) for i in range(n + 1)) for n in range(9))
_DEEPEST = 30


def product(p: Polynomial, q: Polynomial) -> list[float]:
    """Return p·q, of the sum of their degrees."""
    out = [0.0] * (len(p) + len(q) - 1)
    for i, left in enumerate(p):
        for j, right in enumerate(q):
            out[i + j] += left * right
    return out


def raised(p: Polynomial) -> list[float]:
    """Return the same polynomial written two degrees higher: p·((1−t) + t)²."""
    ends = [0.0, 0.0]
    padded = [*ends, *p, *ends]
    return [padded[i] + 2.0 * padded[i + 1] + padded[i + 2] for i in range(len(p) + 2)]


def value(p: Polynomial, t: float) -> float:
    """Return p(t)."""
    degree = len(p) - 1
    return sum(weight * t**i * (1.0 - t) ** (degree - i) for i, weight in enumerate(p))


def falls_below(p: Polynomial, bound: float) -> float | None:
    """Return some t in [0, 1] where p(t) < bound, or None where p ≥ bound is proved for all of [0, 1].

    Where thirty halvings prove neither (p touches the bound to the last digit) the place in doubt is
    returned: the answer errs on the side of a refusal.
    """
    binomials = _BINOMIALS[len(p) - 1]
    pieces = [([weight / choose - bound for weight, choose in zip(p, binomials, strict=True)], 0.0, 1.0)]
    while pieces:
        beta, start, width = pieces.pop()
        if min(beta) >= 0.0:
            continue
        if beta[0] < 0.0:
            return start
        if beta[-1] < 0.0:
            return start + width
        if width <= 0.5**_DEEPEST:
            return start + 0.5 * width
        left, right = _halves(beta)
        width *= 0.5
        pieces += [(right, start + width, width), (left, start, width)]
    return None


def _halves(beta: list[float]) -> tuple[list[float], list[float]]:
    left, right = [beta[0]], [beta[-1]]
    while len(beta) > 1:
        beta = [0.5 * (one + two) for one, two in pairwise(beta)]
        left.append(beta[0])
        right.append(beta[-1])
    return left, right[::-1]
