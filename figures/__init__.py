"""One script per figure of the papers; `python -m figures` draws them."""
