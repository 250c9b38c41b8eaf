"""Questions, lists and files to choose from: what keys and letters do to them."""

from pathlib import Path

from robocov_app.editor.ui.asking import ROWS, Answer, FileQuestion, ListQuestion, Picker, Question


def test_a_question_is_answered_by_letter_enter_and_escape() -> None:
    answers = tuple(Answer(text, text[0].lower(), lambda: None) for text in ("Save", "Discard", "Cancel"))
    question = Question("?", "", answers)
    assert question.answer("d") is answers[1]
    assert question.answer("escape") is answers[2]
    assert question.answer("return") is answers[0]
    question.move(-1)
    assert question.answer("return") is answers[2]
    question.move(1)
    assert question.answer("enter") is answers[0]
    assert question.answer("z") is None


def test_a_picker_finds_by_all_words_and_scrolls() -> None:
    names = [(f"map {k}", "recent" if k < 3 else "bundled") for k in range(20)]
    picker = Picker("Open", names, lambda _: None)
    assert picker.accept() == "map 0"
    for _ in range(ROWS + 2):
        picker.move(1)
    assert picker.chosen == ROWS + 2 and picker.top == 3
    picker.type("bundled 7")
    assert [name for name, _ in picker.options] == ["map 7", "map 17"] and picker.accept() == "map 7"
    picker.type("zzz")
    assert picker.options == [] and picker.accept() is None
    picker.move(1)
    picker.erase(word=True)
    assert picker.text == "bundled "
    assert ListQuestion("", lambda _: None, "").options == []


def asked(folder: Path, **more: object) -> FileQuestion:
    return FileQuestion("Open", folder, lambda _: None, (".json",), **more)


def test_files_are_listed_folders_first_and_hidden_ones_only_when_asked_for(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / ".hidden").mkdir()
    for name in ("b.json", "A.json", "c.txt"):
        (tmp_path / name).write_text("{}")
    question = asked(tmp_path)
    assert [name for name, _ in question.options] == ["..", "sub/", "A.json", "b.json"]
    question.type(".")
    assert [name for name, _ in question.options] == [".hidden/"]


def test_tab_completes_as_far_as_names_agree(tmp_path: Path) -> None:
    for name in ("plan-1.json", "plan-2.json", "other.json"):
        (tmp_path / name).write_text("{}")
    question = asked(tmp_path)
    question.type("p")
    question.complete()
    assert question.text == "plan-"
    question.type("2")
    question.complete()
    assert question.text == "plan-2.json"
    assert question.accept() == str(tmp_path / "plan-2.json")


def test_a_folder_is_a_step_and_up_leads_out_again(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "in.json").write_text("{}")
    question = asked(tmp_path)
    question.move(2)  # "..", then "sub/"
    assert question.accept() is None and question.text == "sub/"
    question.move(2)
    assert question.accept() == str(tmp_path / "sub" / "in.json")
    question.text = "sub/"
    question.move(1)
    assert question.accept() is None and Path(question.text) == tmp_path
    question.text = "sub"
    assert question.accept() is None and question.text == "sub/"


def test_what_cannot_be_a_path_is_no_trouble(tmp_path: Path) -> None:
    question = asked(tmp_path, text="a\0b", saves=True)
    assert question.options == [] and question.accept() is not None
    question.text = "x" * 5000
    assert question.options == []
    assert question.accept() is not None
    question.text = "~nobody-of-that-name/x"
    assert question.options == []
    question.accept()
    question.text = "  "
    assert question.accept() is None
