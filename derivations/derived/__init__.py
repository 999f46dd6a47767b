"""Equations that the library derives itself: read out of its code, and compared with the papers.

Each module has a table `DERIVED` from the id of an equation to a function that returns what must
vanish: what `firstorder.symbolic` reads out of the library less the corrected equation, which is
written out by hand.
"""
