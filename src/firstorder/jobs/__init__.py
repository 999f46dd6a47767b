"""Many independent jobs: in this program, or on the workers of a cluster; sweeps of a table."""

from firstorder.jobs.running import run_jobs
from firstorder.jobs.sweeps import sweep

__all__ = ["run_jobs", "sweep"]
