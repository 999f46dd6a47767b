"""Verification: squares, faults, tolerances, statistics, and one scene by all portraits."""

import importlib

_HOME = {
    "squares": ("Case", "Square", "square", "by_rule", "by_conversion", "goes_red"),
    "faults": ("Fault", "twin", "twin_law"),
    "registry": ("all_cases", "all_faults"),
    "table": ("measure", "as_text", "as_markdown", "read_verdicts"),
    "tolerance": ("rounding", "normwise", "fitted_order"),
    "statistics": (
        "ZTest",
        "z_test",
        "z_test_of",
        "z_threshold",
        "chi_square",
        "sampler_p_value",
        "ErrorSlope",
        "error_slope",
        "spread_test",
    ),
    "certificates": ("certified", "Certificate"),
    "checked_mode": ("checked",),
    "own_events": ("check", "Report", "FaultVerdict"),
}
__all__ = [name for names in _HOME.values() for name in names]  # pyright: ignore


def __getattr__(name: str):
    """Import a name when it is first asked for: the registry builds the light of every case."""
    for module, names in _HOME.items():
        if name in names:
            return getattr(importlib.import_module(f"firstorder.checks.{module}"), name)
    raise AttributeError(f"module 'firstorder.checks' has no attribute {name!r}")
