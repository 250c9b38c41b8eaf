"""Bad input of `robocov paper`; `test_whole_study` tests the study itself."""

from command_calls import read_error


def test_a_folder_with_other_files_is_rejected_and_unchanged(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    message = read_error(capsys, "paper", "--out", str(tmp_path))
    assert "expected an empty folder or a study of the paper" in message
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_study_needs_at_least_one_worker(capsys):
    message = read_error(capsys, "paper", "--out", "x", "--workers", "0")
    assert "--workers: expected a number from 1 to 1024, got 0" in message


def test_the_folder_is_required(capsys):
    assert "--out" in read_error(capsys, "paper")


def test_only_one_part_can_be_selected(capsys):
    message = read_error(capsys, "paper", "--out", "x", "--beyond-only", "--figures-only")
    assert "--figures-only and --beyond-only: expected one of them" in message
