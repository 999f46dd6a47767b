from firstorder.io._damage import set_aside


def test_what_was_set_aside_before_stays(tmp_path):
    file, told = tmp_path / "a.npz", []
    for words in ("one", "two", "three"):
        file.write_text(words)
        told.append(set_aside(file, "cut short"))
        assert not file.exists()
    kept = {f.name: f.read_text() for f in tmp_path.iterdir()}
    assert kept == {"a.npz.damaged": "one", "a.npz.damaged2": "two", "a.npz.damaged3": "three"}
    assert told[1] == "a.npz is damaged (cut short): it is kept as a.npz.damaged2 and made anew."


def test_a_file_that_another_program_has_set_aside_is_no_error(tmp_path):
    set_aside(tmp_path / "a.npz", "cut short")
    assert not list(tmp_path.iterdir())
