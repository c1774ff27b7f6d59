"""p of a report, computed anew from the report and the key by a program that shares nothing with sombrero.

Usage: python3 tests/independent/p_value.py REPORT KEY

REPORT is a page of `sombrero detect --report`, or what `--json` printed beside one. Of the estimate that won, every test
is repeated:

- the correlation's t test, to 6 digits of log10 p;
- the ellipsoid test at every floor: its certified bound by minimising the published formula over a grid that is refined,
  and, where p is not too small, the probability itself by a million random watermarks, which may not exceed the bound
  by more than chance.

Then p as a whole: that of the winner times the number of ways that were counted. Exit status 0 when all agrees, 1
otherwise. Needs numpy and nothing else.
"""

import base64
import json
import math
import re
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np

DRAWS = 1_000_000
BATCH = 20_000
# Monte Carlo says nothing about a smaller p.
SMALLEST_DRAWN = 3e-5
# Tests of one estimate: the correlation, then the ellipsoids.
TESTS = 5
# What is further out is left out of the correlation, and of the ellipsoid.
OUTLIER, FURTHEST = 2.5, 1e3
# Watermarks that agree better than doubles can show count as agreeing so well: a share of the mean distance.
AGREEMENT = 2.0**-104


def record(path: Path) -> dict:
    """The JSON of a report, or in its page."""
    text = path.read_text(encoding="utf-8")
    if text.lstrip().startswith("{"):
        return json.loads(text)
    elements = re.findall(r'<script type="application/json" id="sombrero-evidence">(.*?)</script>', text, re.S)
    if len(elements) != 1:
        sys.exit(f"{path}: {len(elements)} records, one is needed")
    return json.loads(elements[0])


def ln_beta_tail(x: float, a: float, b: float) -> float:
    """ln I_x(a, b), the regularised incomplete beta function, by its continued fraction (Abramowitz and Stegun 26.5.8).

    For x left of the mean, where the fraction is quick.
    """
    front = a * math.log(x) + b * math.log1p(-x) - math.log(a)
    front -= math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)
    # From the last term backwards; 2000 terms are more than any of our cases needs.
    fraction = 1.0
    for n in range(2000, 0, -1):
        m = n // 2
        if n % 2:
            d = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        else:
            d = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        fraction = 1.0 + d / fraction
    return front - math.log(fraction)


def t_test(w: np.ndarray, extracted: list) -> float:
    """log10 Pr[T >= t] for the correlation of what is known and within 2.5 standard deviations."""
    kept = [i for i, e in enumerate(extracted) if e is not None and abs(e) <= OUTLIER]
    if len(kept) < 3:
        return 0.0
    # In exact fractions: next to rho = 1 the last digits of doubles are all that is left of 1 - rho^2.
    a, b = ([Fraction(float(values[i])) for i in kept] for values in (w, extracted))
    a, b = ([x - sum(values) / len(kept) for x in values] for values in (a, b))
    aa, bb, ab = (sum(x * y for x, y in zip(*pair)) for pair in ((a, a), (b, b), (a, b)))
    if aa == 0 or bb == 0:
        return 0.0
    explained = ab * ab / (aa * bb)
    rho, freedom = math.copysign(math.sqrt(explained), ab), len(kept) - 2
    rest = max(float(1 - explained), AGREEMENT)
    half = 0.5 * freedom
    if rest < (half + 1.0) / (half + 2.5):
        ln_tail = ln_beta_tail(rest, half, 0.5) - math.log(2.0)
    else:
        ln_tail = math.log(0.5 - 0.5 * math.exp(ln_beta_tail(rho * rho, 0.5, half)))
    if rho < 0:
        ln_tail = math.log1p(-math.exp(ln_tail))
    return ln_tail / math.log(10.0)


class Ellipsoid:
    """Sum of l (g - c)^2 over the axes of the precision."""

    def __init__(self, centre: np.ndarray, precision: np.ndarray):
        if np.count_nonzero(precision - np.diag(np.diagonal(precision))) == 0:
            values, axes, noise = np.diagonal(precision).copy(), np.eye(len(centre)), 0.0
        else:
            values, axes = np.linalg.eigh(precision)
            noise = len(centre) * np.finfo(float).eps
        values[values <= noise * values.max()] = 0.0
        self.axes, self.centre = axes, axes.T @ centre
        values[np.abs(self.centre) > FURTHEST] = 0.0
        self.precisions = values

    def at(self, floor: float):
        """Precisions and centres of the axes that are determined, with this least standard error."""
        known = self.precisions > 0.0
        values = self.precisions[known]
        return values / (1.0 + floor * floor * values), self.centre[known], known

    def distance(self, w: np.ndarray, floor: float) -> float:
        values, centre, known = self.at(floor)
        return float(np.sum(values * ((self.axes.T @ w)[known] - centre) ** 2))

    def bound(self, distance: float, floor: float) -> float:
        """log10 of the least of exp(s D) E exp(-s X) over s >= 0, each of which bounds Pr[X <= D]."""
        values, centre, _ = self.at(floor)
        mean = float(np.sum(values * (1.0 + centre**2)))
        if not len(values) or distance >= mean:
            return 0.0
        distance = max(distance, AGREEMENT * mean)

        def ln_bound(s: float) -> float:
            y = 2.0 * s * values
            return s * distance - 0.5 * float(np.sum(np.log1p(y) + centre**2 * y / (1.0 + y)))

        # Its minimum lies below (r/2 + sum c^2/8)/D; it falls before and rises after.
        high = math.log((0.5 * len(values) + 0.125 * float(np.sum(centre**2))) / distance) + 1.0
        low = high - 200.0
        for _ in range(40):
            grid = np.linspace(low, high, 33)
            best = int(np.argmin([ln_bound(math.exp(x)) for x in grid]))
            low, high = grid[max(best - 1, 0)], grid[min(best + 1, 32)]
        return min(0.0, ln_bound(math.exp(0.5 * (low + high)))) / math.log(10.0)

    def share(self, distance: float, floor: float, rng: np.random.Generator) -> float:
        """The share of random watermarks that come as close."""
        values, centre, _ = self.at(floor)
        closer = 0
        for _ in range(DRAWS // BATCH):
            draws = rng.standard_normal((BATCH, len(values)))
            closer += int(np.count_nonzero(((draws - centre) ** 2) @ values <= distance))
        return closer / DRAWS


def ellipsoid(fields: dict):
    """The ellipsoid of a record, or None where there is none."""
    if "precision" not in fields:
        return None
    centre = np.array(fields["centre"], dtype=float)
    numbers = np.frombuffer(base64.b64decode(fields["precision"]), dtype="<f8")
    m = len(centre)
    if len(numbers) != m * (m + 1) // 2:
        sys.exit(f"{len(numbers)} numbers are no lower triangle of {m} rows")
    precision = np.zeros((m, m))
    precision[np.tril_indices(m)] = numbers
    return Ellipsoid(centre, precision + np.tril(precision, -1).T)


def near(ours: float, theirs: float, digits: float) -> bool:
    return abs(ours - theirs) <= digits * max(1.0, abs(theirs))


class Check:
    """What was compared."""

    def __init__(self):
        self.failed = 0

    def say(self, what: str, ours: float, theirs: float, good: bool, more: str = ""):
        self.failed += not good
        print(f"{'agrees' if good else 'DIFFERS'}  {what}: log10 p {ours:.6f}, reported {theirs:.6f}{more}")


def check_ellipsoid(check: Check, form: Ellipsoid, w: np.ndarray, variant: dict, rng):
    floor, theirs = variant["floor"], variant["log10_p"]
    distance = form.distance(w, floor)
    ours = form.bound(distance, floor)
    # Theirs allows for the rounding of the distance, which a nearly perfect match consists of.
    good = near(ours, theirs, 1e-6) or (theirs < -100.0 and ours <= theirs <= 0.9 * ours)
    what = f"ellipsoid, floor {floor:g}, D {distance:.6g}"
    check.say(what, ours, theirs, good)
    if 10.0**theirs < SMALLEST_DRAWN:
        return
    share = form.share(distance, floor, rng)
    error = math.sqrt(max(share * (1.0 - share), 1.0 / DRAWS) / DRAWS)
    good = share <= 10.0**theirs + 3.0 * error
    more = f", by {DRAWS} draws {share:.6f} +- {error:.6f}"
    check.say(what, math.log10(max(share, 1.0 / DRAWS)), theirs, good, more)


def main() -> int:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    fields = record(Path(sys.argv[1]))
    w = np.array(json.loads(Path(sys.argv[2]).read_text(encoding="utf-8"))["watermark"], dtype=float)
    check, rng = Check(), np.random.default_rng(1)
    variants, winner = fields["variants"], fields["variant"]
    form = ellipsoid(fields)
    place = variants.index(winner)
    group = [winner] if form is None else variants[place - place % TESTS :][:TESTS]
    for variant in group:
        if variant["test"] == "correlation":
            ours = t_test(w, fields["extracted"])
            check.say("correlation", ours, variant["log10_p"], near(ours, variant["log10_p"], 1e-6))
        else:
            check_ellipsoid(check, form, w, variant, rng)
    ours = min(0.0, winner["log10_p"] + math.log10(fields["variants_counted"]))
    check.say("all ways together", ours, fields["log10_p"], near(ours, fields["log10_p"], 1e-9))
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main())
