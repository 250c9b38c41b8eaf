import errno
import os
import re
import subprocess
import sys
import zlib
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from drawn_run import HALL, ROOMS, record_walk

from robocov.errors import OutputError, ParameterError
from robocov_app.figures.curves import TimeCurve
from robocov_app.figures.files import check_figure_path, save_figure
from robocov_app.figures.runs import plot_cost, plot_environment, plot_trajectories

T = np.linspace(0.0, 60.0, 121)
CURVES = [TimeCurve("RAPF", "rapf", T, 1 + np.exp(-T / 10)), TimeCurve("RPF", "rpf", T, 2 + np.exp(-T / 10))]


def parse_objects(pdf: bytes) -> dict[int, bytes]:
    """Return the dictionaries of a PDF's objects by their numbers, without their streams."""
    found = re.findall(rb"(\d+) 0 obj\n(.*?)(?:\nstream\n|\nendobj)", pdf, flags=re.DOTALL)
    return {int(number): body for number, body in found}


def read_streams(pdf: bytes) -> bytes:
    """Return all that is compressed in a PDF."""
    return b"\n".join(
        zlib.decompress(part)
        for part in re.findall(rb"FlateDecode.*?>>\nstream\n(.*?)\nendstream", pdf, flags=re.DOTALL)
    )


@pytest.mark.parametrize("kind", ["png", "svg", pytest.param("pdf", marks=pytest.mark.slow)])
class TestEveryKind:
    def test_the_same_plot_gives_the_same_bytes(self, tmp_path, kind):
        for name in ("a", "b"):
            save_figure(
                plot_trajectories(record_walk(ROOMS, 4), size=(500, 400)), tmp_path / f"{name}.{kind}"
            )
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()

    def test_the_matplotlib_style_of_the_user_has_no_effect(self, tmp_path, kind):
        save_figure(plot_cost(CURVES, size=(500, 300)), tmp_path / f"a.{kind}")
        theirs = {"font.size": 30, "lines.linewidth": 9, "axes.grid": True, "savefig.bbox": "tight"}
        theirs |= {"pdf.fonttype": 3, "svg.fonttype": "none", "savefig.transparent": True}
        with matplotlib.rc_context(theirs):
            before = dict(matplotlib.rcParams)
            save_figure(plot_cost(CURVES, size=(500, 300)), tmp_path / f"b.{kind}")
            assert dict(matplotlib.rcParams) == before
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()

    def test_names_are_never_markup(self, tmp_path, kind):
        name = "cost $x^2$ $\\frac$ [/] { a)b(c\\ 倉庫 🤖"
        record = replace(record_walk(HALL, 3), environment=replace(HALL, name=name))
        save_figure(plot_trajectories(record, size=(500, 400)), tmp_path / f"a.{kind}")
        assert (tmp_path / f"a.{kind}").stat().st_size > 5000

    def test_a_full_disk_is_named_and_leaves_the_older_file(self, tmp_path, monkeypatch, kind):
        path = tmp_path / f"a.{kind}"
        path.write_bytes(b"older")
        figure = plot_environment(HALL)

        def fail_as_disk_is_full(part, **options):
            Path(part).write_bytes(b"half")
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(figure, "savefig", fail_as_disk_is_full)
        with pytest.raises(OutputError, match=rf"a\.{kind}: cannot be written.*No space"):
            save_figure(figure, path)
        assert path.read_bytes() == b"older"
        assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_the_hashes_of_a_process(tmp_path):
    script = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from drawn_run import ROOMS, record_walk\n"
        "from robocov_app.figures.files import save_figure\n"
        "from robocov_app.figures.runs import plot_trajectories\n"
        "for kind in ('svg', 'pdf'):\n"
        "    save_figure(plot_trajectories(record_walk(ROOMS, 4)), f'{sys.argv[2]}.{kind}')\n"
    )
    for seed in ("1", "2"):
        command = [sys.executable, "-c", script, str(Path(__file__).parents[1]), str(tmp_path / seed)]
        subprocess.run(command, check=True, env={**os.environ, "PYTHONHASHSEED": seed})
    for kind in ("svg", "pdf"):
        assert (tmp_path / f"1.{kind}").read_bytes() == (tmp_path / f"2.{kind}").read_bytes()


def test_an_svg_is_the_same_everywhere(tmp_path):
    """Its letters are outlines, and it bears no date."""
    save_figure(plot_trajectories(record_walk(ROOMS, 4)), tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    assert "<text" not in text and "font-family" not in text
    assert "<dc:date>" not in text


class TestPdf:
    def test_every_font_is_in_it_as_truetype(self, tmp_path):
        save_figure(plot_cost(CURVES, size=(500, 300)), tmp_path / "a.pdf")
        pdf = (tmp_path / "a.pdf").read_bytes()
        objects = parse_objects(pdf)
        fonts = [body for body in objects.values() if re.search(rb"/Type /Font\b(?!Desc)", body)]
        kinds = {re.search(rb"/Subtype /(\w+)", body)[1] for body in fonts}
        assert kinds == {b"Type0", b"CIDFontType2"}, "Type 3 is what publishers refuse"
        described = [body for body in fonts if b"/CIDFontType2" in body]
        assert len(described) >= 2  # plain and bold
        for body in described:
            descriptor = objects[int(re.search(rb"/FontDescriptor (\d+) 0 R", body)[1])]
            file = int(re.search(rb"/FontFile2 (\d+) 0 R", descriptor)[1])
            program = re.search(rb"\n%d 0 obj\n.*?stream\n(.*?)\nendstream" % file, pdf, flags=re.DOTALL)[1]
            assert zlib.decompress(program)[:4] == b"\x00\x01\x00\x00", "no TrueType font"

    def test_texts_of_a_pdf_can_be_searched(self, tmp_path):
        """Every font says which letters its glyphs are."""
        save_figure(plot_cost(CURVES, size=(500, 300)), tmp_path / "a.pdf")
        pdf = (tmp_path / "a.pdf").read_bytes()
        fonts = [body for body in parse_objects(pdf).values() if b"/Subtype /Type0" in body]
        assert fonts and all(b"/ToUnicode" in body for body in fonts)
        assert b"begincmap" in read_streams(pdf)

    def test_its_page_is_the_figures_and_it_bears_no_date(self, tmp_path):
        figure = plot_trajectories(record_walk(ROOMS, 4), size=(900, 600))
        save_figure(figure, tmp_path / "a.pdf")
        pdf = (tmp_path / "a.pdf").read_bytes()
        box = [float(part) for part in re.search(rb"/MediaBox \[ ([^]]+) \]", pdf)[1].split()]
        assert box == pytest.approx([0, 0, *figure.get_size_inches() * 72])
        assert not re.search(rb"CreationDate|ModDate|Producer|matplotlib", pdf)


@pytest.mark.parametrize("name", ["a.eps", "a", "a.jpeg"])
def test_other_suffixes_are_refused(tmp_path, name):
    with pytest.raises(ParameterError, match=r"expected \.png, \.svg or \.pdf, got suffix '.*'"):
        save_figure(plot_environment(HALL), tmp_path / name)
    with pytest.raises(ParameterError, match="suffix"):
        check_figure_path(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_named_before_any_work(tmp_path):
    check_figure_path(tmp_path / "a.PDF")
    with pytest.raises(OutputError, match="there is no folder"):
        check_figure_path(tmp_path / "no" / "a.pdf")
