"""Rows that cannot notice a tenth of a per cent too much or too little in what they name, and why.

`python -m derivations --attack` puts every function that a row names out of true. A row that stands
here and does notice is reported too.
"""

from __future__ import annotations

_REFUSAL = "a refusal has no number"
_ORDER = "an order of an error is the same of every multiple"
_SYMMETRY = "a symmetry holds of every multiple"
_ZERO = "every multiple of zero is zero"
_STATISTICS = "as wide as the error bars of random samples"

UNNOTICED = {
    # Refusals.
    "R07.fig2.convolve.wavelet": _REFUSAL,
    "R07.fig2.warp.fourier": _REFUSAL,
    "R07.fig2.warp.wavelet": _REFUSAL,
    # Orders of errors.
    "R07.fn4": _ORDER,
    "R07.s5.2d": "an order is fitted, to a tenth: what is too little stays within that",
    "D05.s2.1a": _ORDER,
    "D05.s4.1a": _ORDER,
    "C.warp.linearise": _ORDER,
    # Symmetries, and ratios in which the factor cancels.
    "J12.20": _SYMMETRY,
    "D05.s4.1f": _SYMMETRY,
    "R07.s9.1c": "which square is split first does not depend on the scale of the metric",
    "D05.s4.2c": "a waist stays where it is if position and angle are scaled alike",
    "E11.9": "bandwidths scaled alike leave the filter's width over the pixel's",
    # Zeros.
    "R07.fig4.flat-envmap": _ZERO,
    "D05.s3.2a": _ZERO,
    "D05.s3.4c": _ZERO,
    # Statistics, searches and bounds.
    "J12.28": _STATISTICS,
    "J12.29": _STATISTICS,
    "J12.47": "two per cent are left of 16384 strata before a curved limb",
    "J12.71": "a bound from above holds of what is a little larger",
    "J12.fn2": _STATISTICS,
    "E11.sBa": "samples are counted to two per cent",
    "E11.sBb": "where a wave's transform ends is read to one part in eight",
    "D05.s4.1d": "an energy is bounded to four per cent",
    "D05.s4.3c": "an energy is bounded to one per cent",
    "C.space.direct.mean": "what is left out is of the size of half a per cent",
    "C.space.uncovered": "a sixth of the term is left where light varies behind two edges",
    "C.cache.third": "an expansion is good to two thousandths",
    "C.bandwidth.slope": "changes are counted to two per cent",
    "C.bandwidth.density": "an optimum is flat: searched to two per cent",
}
