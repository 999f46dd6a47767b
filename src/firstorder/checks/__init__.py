"""Verification: squares, faults, tolerances, statistics, and one scene by all portraits."""

from firstorder._on_demand import on_demand

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

# Names are imported when they are first asked for: the registry builds the light of every case.
__getattr__, __dir__ = on_demand(__name__, (*_HOME, "agreements", "cases"), _HOME)
