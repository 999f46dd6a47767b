"""One script per still: `still(frame)` gives levels of a screen, or a figure drawn on the frame.

The first line of the docstring is the still's title, the rest its caption.
"""
