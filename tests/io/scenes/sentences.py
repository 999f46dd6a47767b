"""What every reader of files owes its user when a file is no good."""


def refuses_in_one_sentence(read, source):
    """Reads it, or says in one line why not; anything else fails the test."""
    try:
        read(source, "f")
    except ValueError as error:
        words = str(error)
    else:
        words = "f"
    assert words.startswith("f")
    assert "\n" not in words
