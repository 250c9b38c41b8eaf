"""Files of figures: the same bytes everywhere, embedded fonts, and errors."""

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
from robocov_app.figures.cost_curves import plot_cost
from robocov_app.figures.curves import TimeCurve
from robocov_app.figures.files import check_figure_path, save_figure
from robocov_app.figures.map_pages import plot_environment, plot_trajectories

TIME = np.linspace(0.0, 60.0, 121)
CURVES = [
    TimeCurve("RAPF", "rapf", TIME, 1 + np.exp(-TIME / 10)),
    TimeCurve("RPF", "rpf", TIME, 2 + np.exp(-TIME / 10)),
]


def parse_objects(pdf: bytes) -> dict[int, bytes]:
    """Return the dictionaries of the objects in a PDF by their numbers, without streams."""
    objects = re.findall(rb"(\d+) 0 obj\n(.*?)(?:\nstream\n|\nendobj)", pdf, flags=re.DOTALL)
    return {int(number): dictionary for number, dictionary in objects}


def list_fonts(pdf: bytes) -> list[bytes]:
    """Return the dictionaries of all fonts in a PDF."""
    return [body for body in parse_objects(pdf).values() if re.search(rb"/Type /Font\b(?!Desc)", body)]


def read_stream(pdf: bytes, number: int) -> bytes:
    """Return the decompressed stream of an object in a PDF."""
    stream = re.search(rb"\n%d 0 obj\n.*?stream\n(.*?)\nendstream" % number, pdf, flags=re.DOTALL)
    assert stream is not None
    return zlib.decompress(stream[1])


def read_all_streams(pdf: bytes) -> bytes:
    """Return all decompressed streams of a PDF."""
    streams = re.findall(rb"FlateDecode.*?>>\nstream\n(.*?)\nendstream", pdf, flags=re.DOTALL)
    return b"\n".join(zlib.decompress(stream) for stream in streams)


def save_cost_as_pdf(folder: Path) -> bytes:
    """Save a figure of two cost curves, and return the bytes of the PDF."""
    path = folder / "cost.pdf"
    save_figure(plot_cost(CURVES, size=(500, 300)), path)
    return path.read_bytes()


@pytest.mark.parametrize("suffix", ["png", "svg", pytest.param("pdf", marks=pytest.mark.slow)])
class TestAllFormats:
    def test_the_same_plot_gives_the_same_bytes(self, tmp_path: Path, suffix: str) -> None:
        paths = [tmp_path / f"{name}.{suffix}" for name in ("first", "second")]
        for path in paths:
            save_figure(plot_trajectories(record_walk(ROOMS, 4), size=(500, 400)), path)
        assert paths[0].read_bytes() == paths[1].read_bytes()

    def test_the_matplotlib_style_of_the_user_has_no_effect(self, tmp_path: Path, suffix: str) -> None:
        path = tmp_path / f"plain.{suffix}"
        save_figure(plot_cost(CURVES, size=(500, 300)), path)
        style = {
            "font.size": 30,
            "lines.linewidth": 9,
            "axes.grid": True,
            "savefig.bbox": "tight",
            "savefig.transparent": True,
            "pdf.fonttype": 3,
            "svg.fonttype": "none",
        }
        path_with_style = tmp_path / f"styled.{suffix}"
        with matplotlib.rc_context(style):
            save_figure(plot_cost(CURVES, size=(500, 300)), path_with_style)
        assert path_with_style.read_bytes() == path.read_bytes()

    def test_the_matplotlib_style_of_the_user_is_not_changed(self, tmp_path: Path, suffix: str) -> None:
        with matplotlib.rc_context({"font.size": 30, "savefig.bbox": "tight"}):
            settings = dict(matplotlib.rcParams)
            save_figure(plot_cost(CURVES, size=(500, 300)), tmp_path / f"cost.{suffix}")
            assert dict(matplotlib.rcParams) == settings

    def test_names_may_contain_markup_and_missing_characters(self, tmp_path: Path, suffix: str) -> None:
        name = "cost $x^2$ $\\frac$ [/] { a)b(c\\ 倉庫 🤖"
        record = replace(record_walk(HALL, 3), environment=replace(HALL, name=name))
        path = tmp_path / f"trajectories.{suffix}"
        save_figure(plot_trajectories(record, size=(500, 400)), path)
        assert path.stat().st_size > 5000

    def test_on_a_full_disk_an_existing_file_is_kept(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
    ) -> None:
        path = tmp_path / f"map.{suffix}"
        path.write_bytes(b"older")
        figure = plot_environment(HALL)

        def write_half_and_fail(partial_path: str, **options: object) -> None:
            Path(partial_path).write_bytes(b"half")
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(figure, "savefig", write_half_and_fail)
        with pytest.raises(OutputError, match=rf"map\.{suffix}: cannot be written.*No space"):
            save_figure(figure, path)
        assert path.read_bytes() == b"older"
        assert list(tmp_path.iterdir()) == [path]


_SAVE_TRAJECTORIES = """
import sys
sys.path.insert(0, sys.argv[1])
from drawn_run import ROOMS, record_walk
from robocov_app.figures.files import save_figure
from robocov_app.figures.map_pages import plot_trajectories
for suffix in ("svg", "pdf"):
    save_figure(plot_trajectories(record_walk(ROOMS, 4)), f"{sys.argv[2]}.{suffix}")
"""


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_the_hash_seed_of_the_process(tmp_path: Path) -> None:
    tests_folder = Path(__file__).parents[1]
    for seed in ("1", "2"):
        command = [sys.executable, "-c", _SAVE_TRAJECTORIES, str(tests_folder), str(tmp_path / seed)]
        subprocess.run(command, check=True, env={**os.environ, "PYTHONHASHSEED": seed})
    for suffix in ("svg", "pdf"):
        assert (tmp_path / f"1.{suffix}").read_bytes() == (tmp_path / f"2.{suffix}").read_bytes()


def test_an_svg_needs_no_fonts_and_has_no_date(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.svg"
    save_figure(plot_trajectories(record_walk(ROOMS, 4)), path)
    text = path.read_text()
    assert "<text" not in text
    assert "font-family" not in text
    assert "<dc:date>" not in text


class TestPdf:
    def test_no_font_has_type_3(self, tmp_path: Path) -> None:
        """Publishers reject Type 3 fonts."""
        subtypes = set()
        for font in list_fonts(save_cost_as_pdf(tmp_path)):
            subtype = re.search(rb"/Subtype /(\w+)", font)
            assert subtype is not None
            subtypes.add(subtype[1])
        assert subtypes == {b"Type0", b"CIDFontType2"}

    def test_regular_and_bold_fonts_are_embedded_as_truetype(self, tmp_path: Path) -> None:
        pdf = save_cost_as_pdf(tmp_path)
        objects = parse_objects(pdf)
        embedded_fonts = [font for font in list_fonts(pdf) if b"/CIDFontType2" in font]
        assert len(embedded_fonts) >= 2
        for font in embedded_fonts:
            descriptor_number = re.search(rb"/FontDescriptor (\d+) 0 R", font)
            assert descriptor_number is not None
            descriptor = objects[int(descriptor_number[1])]
            file_number = re.search(rb"/FontFile2 (\d+) 0 R", descriptor)
            assert file_number is not None
            truetype_signature = b"\x00\x01\x00\x00"
            assert read_stream(pdf, int(file_number[1])).startswith(truetype_signature)

    def test_texts_can_be_searched(self, tmp_path: Path) -> None:
        pdf = save_cost_as_pdf(tmp_path)
        fonts = [body for body in parse_objects(pdf).values() if b"/Subtype /Type0" in body]
        assert fonts
        assert all(b"/ToUnicode" in font for font in fonts)
        assert b"begincmap" in read_all_streams(pdf)

    def test_the_page_has_the_size_of_the_figure(self, tmp_path: Path) -> None:
        figure = plot_trajectories(record_walk(ROOMS, 4), size=(900, 600))
        path = tmp_path / "trajectories.pdf"
        save_figure(figure, path)
        media_box = re.search(rb"/MediaBox \[ ([^]]+) \]", path.read_bytes())
        assert media_box is not None
        points_per_inch = 72
        width, height = figure.get_size_inches() * points_per_inch
        assert [float(number) for number in media_box[1].split()] == pytest.approx([0, 0, width, height])

    def test_a_pdf_has_no_date_and_no_producer(self, tmp_path: Path) -> None:
        pdf = save_cost_as_pdf(tmp_path)
        assert not re.search(rb"CreationDate|ModDate|Producer|matplotlib", pdf)


@pytest.mark.parametrize("name", ["a.eps", "a", "a.jpeg"])
def test_other_suffixes_are_rejected(tmp_path: Path, name: str) -> None:
    with pytest.raises(ParameterError, match=r"expected \.png, \.svg or \.pdf, got suffix '.*'"):
        save_figure(plot_environment(HALL), tmp_path / name)
    with pytest.raises(ParameterError, match="suffix"):
        check_figure_path(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_suffix_may_be_in_upper_case(tmp_path: Path) -> None:
    check_figure_path(tmp_path / "a.PDF")


def test_a_missing_folder_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="there is no folder"):
        check_figure_path(tmp_path / "no" / "a.pdf")
