"""How fast the machine is at the moment, for tests of processor time."""

import time

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

USUAL = 0.08  # processor time of an empty canvas where the bounds of time were measured [s]


def slower() -> float:
    """How many times as long an empty canvas takes as where bounds were measured, at least 1.

    Processor time does not count what other processes do, but two threads of one core, a crowded
    cache and a lower clock make all of it longer, the drawing of axes like the rest.
    """
    return max(1.0, min(_empty_canvas() for _ in range(3)) / USUAL)


def _empty_canvas() -> float:
    start = time.process_time()
    figure = Figure((8.0, 5.0))
    figure.subplots(2, 3)
    FigureCanvasAgg(figure).draw()
    return time.process_time() - start
