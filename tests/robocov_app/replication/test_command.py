"""Bad input of `robocov paper`; `test_whole_study` tests the study itself."""

from called import read_error


def test_bad_input(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    message = read_error(capsys, "paper", "--out", str(tmp_path))
    assert "expected an empty folder or a study of the paper" in message
    assert "--workers: expected a number from 1 to 1024, got 0" in read_error(
        capsys, "paper", "--out", "x", "--workers", "0"
    )
    assert "--out" in read_error(capsys, "paper")
    said = read_error(capsys, "paper", "--out", "x", "--beyond-only", "--figures-only")
    assert "--figures-only and --beyond-only: expected one of them" in said
    assert (tmp_path / "notes.txt").read_text() == "mine"
