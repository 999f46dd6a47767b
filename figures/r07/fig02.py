r"""R07 Fig. 2: what each of the five laws does to each portrait, with the measured error.

The paper prints formulas; here each cell is a square walked both ways: the law's rule applied to
the portrait, and the portrait of the result drawn by a route that shares no code (autodiff for
jets, transforms of samples for the rest). The paper has the columns gradient, Fourier and wavelet;
Hessian and covariance are ours. It leaves the light open; ours is an off-centre, correlated
Gaussian (`firstorder.checks.all_cases`), which no sign and no phase error survives.

One entry does not hold as printed. The wavelet coefficients of an integral are $\sqrt{T} F_{i0}$ on
an interval of length $T$, and $F_{i0}$ only for $T = 1$. The gradient of an integral has boundary
terms where the light jumps or the ends move; nothing jumps here (ledger: R07.fig2.integrate).
"""

from __future__ import annotations

import numpy as np

from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_most
from firstorder import plotting
from firstorder.checks.registry import all_cases
from firstorder.checks.squares import PORTRAITS, Square, by_conversion
from firstorder.checks.table import LAWS, Table, measure
from firstorder.checks.tolerance import normwise
from firstorder.fields import Wavelet

NONE = "no simple formula"
# In the order of PORTRAITS: value, gradient, Hessian (ours), spectrum, covariance (ours), wavelet.
RULES = {
    "multiply": (
        r"$h = f\,g$",
        r"$f\,\nabla g + g\,\nabla f$",
        r"$f Hg + g Hf + \nabla f\,\nabla g^T + \nabla g\,\nabla f^T$",
        r"$F \otimes G$",
        r"$\Sigma_f + \Sigma_g$",
        r"$H_i = C_{ijk}\,F_j\,G_k$",
    ),
    "integrate": (
        r"$h = \int f\,d\theta$",
        r"$h_x = \int f_x\,d\theta$",
        r"$h_{xx} = \int f_{xx}\,d\theta$",
        r"$F(\Omega_x, 0)$",
        r"$1\,/\,(\Sigma^{-1})_{xx}$",
        r"$H_i = \sqrt{T}\,F_{i0}$",
    ),
    "convolve": (
        r"$h = \int f(\omega)\,g(\theta - \omega)\,d\omega$",
        r"$\nabla f \otimes g$",
        r"$Hf \otimes g$",
        r"$F(\Omega)\,G(\Omega_\theta)$",
        r"$(\Sigma^{-1} + e e^T / s)^{-1}$",
        NONE,
    ),
    "move": (
        r"$h = f(M u)$",
        r"$M^T\,\nabla f$",
        r"$M^T\,Hf\,M$",
        r"$F(M^{-T}\,\Omega)\,/\,|\det M|$",
        r"$M^T\,\Sigma\,M$",
        NONE,
    ),
    "warp": (
        r"$h = f(T(u))$",
        r"$J^T\,\nabla f$",
        r"$J^T\,Hf\,J + \sum_i f_i\,H T_i$",
        NONE,
        NONE,
        NONE,
    ),
}
HEADS = (
    "radiance",
    "gradient",
    "Hessian (not in the paper)",
    "Fourier",
    "covariance (not in the paper)",
    "wavelet",
)
LENGTH = (
    "H_i = F_i0 lacks a factor: orthonormal wavelets on an interval of length T give sqrt(T) F_i0. "
    "It holds for T = 1 alone; here T is that of the case."
)
REFUSED = {("warp", "spectrum"), *((law, "wavelet") for law in ("convolve", "move", "warp"))}


def draw(quick: bool) -> Drawing:
    table = measure()
    figure, axes = plotting.panels(1, 1, 13.0, 4.2)
    plotting.draw_table(
        axes[0, 0],
        HEADS,
        LAWS,
        [[_words(RULES[law][j], table[law][p]) for j, p in enumerate(PORTRAITS)] for law in LAWS],
        [[table[law][p].verdict for p in PORTRAITS] for law in LAWS],
        wrap=60,
        title="Apply, then convert = convert, then apply: normwise error of each square",
    )
    arrays = {
        "errors": np.array([[s.error or 0.0 for s in table[law].values()] for law in LAWS]),
        "verdicts": np.array([[s.verdict for s in table[law].values()] for law in LAWS]),
        "laws": np.array(LAWS),
        "portraits": np.array(PORTRAITS),
    }
    size = " x ".join(map(str, all_cases()["move"].grid.size)) + " samples, the same when quick"
    return Drawing(figure, arrays, _claims(table), size=size)


def _words(rule: str, s: Square) -> str:
    verdict = "refused" if s.error is None else f"{s.verdict}, {s.error:.0e}".replace("0e+00", "0")
    return f"{rule}\n{verdict}"


def _claims(table: Table) -> list[Statement | Measurement]:
    """The paper's three columns; errors are normwise, and within the bounds of the squares."""
    told: list[Statement | Measurement] = []
    for law in LAWS:
        for portrait in ("gradient", "spectrum", "wavelet"):
            if (law, portrait) not in REFUSED:
                told.append(_claim(law, portrait, table[law][portrait]))
    refused = sum(table[law][portrait].verdict == "refused" for law, portrait in REFUSED)
    words = "Entries that say 'no simple formula', and that the library refuses"
    return [*told, Measurement(words, f"{refused} of {len(REFUSED)}", source="R07 Fig. 2")]


def _claim(law: str, portrait: str, square: Square) -> Statement:
    words, error = f"{law}: error of the rule for the {portrait}", square.error
    if (law, portrait) == ("integrate", "wavelet"):
        words, error = f"{words}, as printed", _without_length()
    rule = at_most(all_cases()[law].bound(portrait), "an identity, to rounding and the grid")
    return Statement(words, "exact", error, rule, "R07 Fig. 2", reason=LENGTH)


def _without_length() -> float:
    """Error of `H_i = F_i0` on the interval of the case, whose length is not 1."""
    case = all_cases()["integrate"]
    assert case.wavelet_grid is not None
    F = Wavelet.of(case.field, case.wavelet_grid).coefficients
    return normwise(F[:, 0], by_conversion(case, "wavelet"))
