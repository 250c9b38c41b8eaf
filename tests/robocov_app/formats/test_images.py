"""Pictures of every kind give the same brightness; broken or too large ones are rejected."""

import io
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, PngImagePlugin
from property_examples import count_examples
from raster_files import build_chunk, build_pgm, encode_png

from robocov.errors import MapError
from robocov_app.formats.raster.picture import Brightness, is_picture, read_picture

GRAY = np.array([[0, 17, 34, 255], [255, 204, 119, 0], [136, 0, 255, 51]], dtype=np.uint8)
"""Multiples of 17: as exact in 4 bits as in 8."""


def save_png(image: Image.Image, **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, format="PNG", **options)
    return stream.getvalue()


def read(folder: Path, data: bytes) -> Brightness:
    path = folder / "picture"
    path.write_bytes(data)
    return read_picture(path, "picture")


def shade(picture: Brightness) -> np.ndarray:
    return picture.level / picture.max_level


PLAIN_PGM = "P2\n# a comment\n4 # and here\n3\n#another\n255\n" + "\n".join(
    " ".join(map(str, row)) for row in GRAY
)
DEEP_GRAY = np.rint(GRAY / 255 * 65535).astype(int)


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(build_pgm(GRAY), id="8 bits"),
        pytest.param(build_pgm(GRAY, head="# one\n#two\n\n"), id="comments"),
        pytest.param(
            build_pgm(GRAY).replace(b"\n", b" ", 1).replace(b"255\n", b"255\t", 1), id="spaces and tabs"
        ),
        pytest.param(b"P5\r\n4 3\r\n255\r\n" + GRAY.tobytes(), id="CR LF"),
        pytest.param(build_pgm(GRAY) + b"and more after it", id="trailing bytes"),
        pytest.param(PLAIN_PGM.encode(), id="plain"),
        pytest.param(PLAIN_PGM.replace("\n", "\r\n").encode(), id="plain, CR LF"),
        pytest.param(
            PLAIN_PGM.replace("17 34", "17 # in the middle\n34").encode(), id="plain, comment between values"
        ),
        pytest.param(build_pgm(DEEP_GRAY, 65535), id="16 bits"),
        pytest.param(
            f"P2 4 3 65535 {' '.join(map(str, DEEP_GRAY.ravel()))}".encode(), id="plain, 16 bits, one line"
        ),
        pytest.param(build_pgm(np.rint(GRAY / 255 * 15), 15), id="maximum of 15"),
    ],
)
def test_all_pgm_variants_give_the_same_brightness(tmp_path: Path, data: bytes) -> None:
    picture = read(tmp_path, data)
    np.testing.assert_allclose(shade(picture), GRAY / 255, atol=1e-5)
    assert picture.alpha is None
    assert is_picture(data)


def test_the_first_byte_after_the_header_of_a_pgm_may_look_like_a_line_break(tmp_path: Path) -> None:
    first = np.full((1, 3), 10, dtype=np.uint8)
    np.testing.assert_array_equal(read(tmp_path, b"P5 3 1 255\n" + first.tobytes()).level, first)


def test_png_of_every_depth_and_color_is_read(tmp_path: Path) -> None:
    base = Image.fromarray(GRAY)
    packed = b"".join(
        b"\0" + bytes((row[0] // 17 << 4 | row[1] // 17, row[2] // 17 << 4 | row[3] // 17)) for row in GRAY
    )
    deep = b"".join(b"\0" + (row.astype(">u2") * 257).tobytes() for row in GRAY)
    files = {
        "8 bit": save_png(base),
        "4 bit": encode_png(4, 3, 4, 0, packed),
        "16 bit": encode_png(4, 3, 16, 0, deep),
        "palette": save_png(base.convert("P")),
        "RGB": save_png(base.convert("RGB")),
        "interlaced": encode_png(1, 1, 8, 0, b"\0\x77", interlaced=1),
    }
    for name, data in files.items():
        picture = read(tmp_path, data)
        expected = GRAY if name != "interlaced" else np.array([[0x77]])
        np.testing.assert_allclose(shade(picture), expected / 255, atol=1e-5, err_msg=name)
        assert picture.alpha is None
    for bits, step in ((1, 255), (2, 85)):
        levels = np.array([0, 1, 1, 0] if bits == 1 else [0, 1, 3, 2])
        row = int(sum(int(v) << (8 - bits * (k + 1)) for k, v in enumerate(levels)))
        picture = read(tmp_path, encode_png(4, 1, bits, 0, bytes((0, row))))
        np.testing.assert_array_equal(shade(picture)[0], levels * step / 255)


def test_colors_are_averaged_and_alpha_is_separate(tmp_path: Path) -> None:
    colors = np.array([[[255, 0, 0, 255], [0, 255, 0, 128], [10, 20, 30, 0]]], dtype=np.uint8)
    picture = read(tmp_path, save_png(Image.fromarray(colors)))
    assert picture.max_level == 765
    assert picture.level.tolist() == [[255, 255, 60]]
    assert picture.alpha is not None
    assert picture.alpha.tolist() == [[255, 128, 0]]
    gray = read(tmp_path, save_png(Image.fromarray(np.array([[[7, 255], [9, 3]]], dtype=np.uint8))))
    assert (gray.max_level, gray.level.tolist()) == (255, [[7, 9]])
    assert gray.alpha is not None and gray.alpha.tolist() == [[255, 3]]
    deep = b"\0" + struct.pack(">8H", 65535, 0, 0, 65535, 257, 514, 771, 0)
    picture = read(tmp_path, encode_png(2, 1, 16, 6, deep))
    assert picture.level.tolist() == [[255, 6]]
    assert picture.alpha is not None and picture.alpha.tolist() == [[255, 0]]


def test_transparent_colors_are_recognized(tmp_path: Path) -> None:
    image = Image.fromarray(np.array([[0, 1, 2]], dtype=np.uint8), mode=None).convert("L")
    palette = Image.new("P", (3, 1))
    palette.putpalette([0, 0, 0, 255, 255, 255, 100, 100, 100])
    palette.putdata([0, 1, 2])
    picture = read(tmp_path, save_png(palette, transparency=2))
    assert picture.alpha is not None and picture.alpha.tolist() == [[255, 255, 0]]
    assert picture.level.tolist() == [[0, 765, 300]]
    picture = read(tmp_path, save_png(image, transparency=1))
    assert picture.alpha is not None and picture.alpha.tolist() == [[255, 0, 255]]


def test_texts_in_png_are_read(tmp_path: Path) -> None:
    texts = PngImagePlugin.PngInfo()
    texts.add_text("Title", "a plan")
    texts.add_itxt("robocov", "α", zip=True)
    picture = read(tmp_path, save_png(Image.fromarray(GRAY), pnginfo=texts))
    assert picture.texts["Title"] == "a plan"
    assert picture.texts["robocov"] == "α"


def test_long_plain_pictures_are_read_piece_by_piece(tmp_path: Path) -> None:
    pixels = np.random.default_rng(3).integers(0, 65536, (700, 600))
    text = "P2 600 700 65535\n" + "\n".join(" ".join(map(str, row)) for row in pixels)
    np.testing.assert_array_equal(read(tmp_path, text.encode()).level, pixels)


def test_tall_pictures_are_converted_strip_by_strip(tmp_path: Path) -> None:
    tall = np.random.default_rng(1).integers(0, 256, (1500, 3, 3), dtype=np.uint8)
    picture = read(tmp_path, save_png(Image.fromarray(tall)))
    np.testing.assert_array_equal(picture.level, tall.sum(axis=2))


COLORS = np.array([[[255, 0, 0], [0, 250, 0]], [[0, 3, 255], [10, 20, 30]], [[9, 9, 9], [255, 255, 255]]])


def encode_image(image: Image.Image, image_format: str, **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, image_format, **options)
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["BMP", "TIFF", "PPM", "PNG"])
@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB", "RGBA", "I;16", "CMYK"])
def test_other_formats_are_as_bright_as_a_png(tmp_path: Path, kind: str, mode: str) -> None:
    image = Image.fromarray(COLORS.astype(np.uint8)).convert("L" if mode == "I;16" else mode)
    if mode == "I;16":
        image = Image.fromarray(np.asarray(image).astype(np.uint16) * 257)
    if (kind, mode) in {("BMP", "I;16"), ("BMP", "CMYK"), ("PPM", "CMYK"), ("PNG", "CMYK"), ("PPM", "P")}:
        pytest.skip("is never saved so")
    data = encode_image(image, kind)
    assert is_picture(data)
    picture = read(tmp_path, data)
    plain = image.convert("I") if mode == "I;16" else image.convert("RGB")
    expected = np.asarray(plain) / 65535 if mode == "I;16" else np.asarray(plain).sum(axis=2) / 765
    np.testing.assert_allclose(shade(picture), expected, atol=1e-9)
    assert (picture.alpha is not None) == (mode == "RGBA" and kind in ("TIFF", "PNG"))
    assert not picture.lossy


@pytest.mark.parametrize("compression", ["tiff_lzw", "tiff_adobe_deflate", "packbits", "group4"])
def test_compressed_tiff_is_read(tmp_path: Path, compression: str) -> None:
    image = Image.fromarray(np.array(GRAY, dtype=np.uint8)).convert("1" if compression == "group4" else "L")
    picture = read(tmp_path, encode_image(image, "TIFF", compression=compression))
    np.testing.assert_array_equal(shade(picture), np.asarray(image.convert("L")) / 255)


@pytest.mark.parametrize("kind", [">u2", "<u2"])
@pytest.mark.parametrize("white_is_zero", [False, True])
def test_tiff_of_16_bits_is_read(tmp_path: Path, kind: str, white_is_zero: bool) -> None:
    order = kind[0]
    pixels = np.array([[0, 65535], [1000, 2000]]).astype(kind).tobytes()
    tags = [
        (256, 2),
        (257, 2),
        (258, 16),
        (259, 1),
        (262, int(not white_is_zero)),
        (273, 8),
        (278, 2),
        (279, 8),
    ]
    entries = b"".join(struct.pack(f"{order}HHII", tag, 4, 1, value) for tag, value in tags)
    head = (b"MM" if order == ">" else b"II") + struct.pack(f"{order}HI", 42, 16)
    data = head + pixels + struct.pack(f"{order}H", len(tags)) + entries + b"\0\0\0\0"
    if order == ">" and white_is_zero:  # Pillow does not support this combination
        with pytest.raises(
            MapError, match="expected a complete TIFF, got a broken one: cannot identify image file"
        ):
            read(tmp_path, data)
        return
    expected = np.array([[0, 65535], [1000, 2000]]) / 65535
    np.testing.assert_allclose(shade(read(tmp_path, data)), 1 - expected if white_is_zero else expected)


def encode_floats(values: list[list[float]]) -> bytes:
    return encode_image(Image.fromarray(np.array(values, dtype=np.float32)), "TIFF")


def test_a_tiff_of_floats_from_0_to_1_is_read(tmp_path: Path) -> None:
    picture = read(tmp_path, encode_floats([[0.0, 0.25, 1.0], [0.5, math.nan, -0.0]]))
    np.testing.assert_allclose(shade(picture), [[0, 0.25, 1], [0.5, 0, 0]], atol=1e-4)
    assert picture.alpha is not None
    assert (picture.alpha == [[255, 255, 255], [255, 0, 255]]).all()
    assert read(tmp_path, encode_floats([[0.0, 1.0]])).alpha is None


@pytest.mark.parametrize(
    ("image", "found"),
    [
        (
            encode_floats([[0.0, 812.5], [-3.0, 1.0]]),
            "floating-point samples from 0 (black) to 1 (white), got -3 to 812.5",
        ),
        (encode_floats([[0.0, 255.0]]), "floating-point samples from 0 (black) to 1 (white), got 0 to 255"),
        (
            encode_floats([[math.nan, math.inf]]),
            "samples from 0 (black) to 1 (white), got none that is a number",
        ),
        (encode_image(Image.new("I", (3, 3)), "TIFF"), "unsigned samples of up to 16 bits"),
    ],
    ids=["heights", "bytes", "nan", "whole"],
)
def test_a_tiff_of_unclear_samples_is_rejected(tmp_path: Path, image: bytes, found: str) -> None:
    with pytest.raises(MapError) as caught:
        read(tmp_path, image)
    message = str(caught.value)
    assert f"a TIFF whose brightness is unclear: expected {found}. Convert it to 8 bits" in message
    assert "broken" not in message


@pytest.mark.parametrize("kind", ["JPEG", "TIFF", "PNG"])
@pytest.mark.parametrize("turn", range(1, 9))
def test_pictures_are_oriented_by_their_exif_data(tmp_path: Path, kind: str, turn: int) -> None:
    image = Image.new("L", (16, 8), 255)
    image.paste(0, (0, 0, 8, 8))
    upright = {1: image, 2: image.transpose(Image.Transpose.FLIP_LEFT_RIGHT)}
    upright |= {3: image.rotate(180), 4: image.transpose(Image.Transpose.FLIP_TOP_BOTTOM)}
    upright |= {5: image.transpose(Image.Transpose.TRANSPOSE), 6: image.rotate(-90, expand=True)}
    upright |= {7: image.transpose(Image.Transpose.TRANSVERSE), 8: image.rotate(90, expand=True)}
    exif = Image.Exif()
    exif[274] = turn
    picture = read(tmp_path, encode_image(image, kind, exif=exif))
    np.testing.assert_array_equal(picture.level, np.asarray(upright[turn]))


@pytest.mark.parametrize("mode", ["L", "RGB", "CMYK"])
def test_jpeg_is_read(tmp_path: Path, mode: str) -> None:
    image = Image.new("RGB", (32, 16), (250, 240, 230))
    image.paste((20, 0, 10), (8, 0, 24, 16))
    picture = read(tmp_path, encode_image(image.convert(mode), "JPEG", quality=95))
    assert picture.lossy and picture.level.shape == (16, 32)
    np.testing.assert_allclose(shade(picture), np.asarray(image).sum(axis=2) / 765, atol=0.05)


def test_a_jpeg_with_several_pictures_is_read_as_a_jpeg(tmp_path: Path) -> None:
    image = Image.new("RGB", (32, 16), (250, 240, 230))
    preview = image.resize((16, 8))
    data = encode_image(image, "MPO", save_all=True, append_images=[preview])
    picture = read(tmp_path, data)
    assert picture.lossy and picture.level.shape == (16, 32)


def test_ppm_of_16_bits_and_in_ascii_is_read(tmp_path: Path) -> None:
    deep = (COLORS * 257).astype(">u2")
    words = " ".join(map(str, COLORS.ravel().tolist()))
    for data in (b"P6 2 3 65535\n" + deep.tobytes(), f"P3 2 3 255 {words}".encode()):
        np.testing.assert_array_equal(shade(read(tmp_path, data)), COLORS.sum(axis=2) / 765)


WHOLE = save_png(Image.fromarray(np.random.default_rng(2).integers(0, 256, (40, 30), dtype=np.uint8)))


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "begins with b''"),
        (b"GIF89a", "expected a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM, got a file that begins with b'GIF"),
        (b"P6 1 1 255 ab", "expected 1 pixels, got 0"),
        (b"P6 1 1 9 abc", "expected pixels of at most 9"),
        (b"P5", "width: expected a whole number"),
        (b"P5 -3 4 255\n", "width: expected a whole number, got b'-3 4 255\\n'"),
        (b"P5 3.5 4 255\n", "height: expected a whole number, got b'.5 4 255\\n'"),
        (b"P5 nan 4 255\n", "width: expected a whole number, got b'nan 4 255\\n'"),
        (b"P5 # no end", "width: expected a whole number, got b'# no end'"),
        (b"P5 0 4 255\n", "expected at least 1 x 1 cells, got 0 x 4"),
        (b"P5 1000000000 1000000000 255\n", "width: expected a whole number, got b'1000000000 1'"),
        (b"P5 999999999 999999999 255\n", "expected at most 64 million"),
        (b"P5 4 4 0\n", "maximum: expected a number from 1 to 65535, got 0"),
        (b"P5 4 4 65536\n", "maximum: expected a number from 1 to 65535, got 65536"),
        (b"P5 4 4 255", "expected 16 pixels, got 0"),
        (b"P5 4 4 255\n" + b"a" * 15, "expected 16 pixels, got 15"),
        (b"P5 4 4 999\n" + b"\0" * 31, "expected 16 pixels, got 15"),
        (b"P5 2 1 9\n\x05\x0a", "expected pixels of at most 9"),
        (b"P2 4 4 255\n1 2 3", "expected 16 pixels, got only 6 bytes"),
        (b"P2 2 2 255\n1 2 3       ", "expected 4 pixels, got 3"),
        (b"P3 2 2 255\n1 2 3 4 5 6 7 8 9 10 11", "expected 4 pixels, got 3"),
        (b"P3 2 2 255\n1 2 3", "expected 4 pixels, got only 6 bytes"),
        (b"P2 2 2 255\n1 x 3 4 5", "got other text"),
        (b"P2 2 2 255\n1 2.5 3 4", "got other text"),
        (b"P2 2 2 255\n1 -2 3 4 5", "expected pixels from 0 to 65535, got -2"),
        (b"P2 2 2 255\n1 256 3 4 5", "expected pixels of at most 255"),
        (b"P2 2 2 255\n1 99999999999999999999 3 4", "pixels"),
        (WHOLE[:20], "expected a complete PNG, got a broken one: Truncated File Read"),
        (WHOLE[:60], "got a broken one: image file is truncated"),
        (WHOLE[:-60], "got a broken one: image file is truncated"),
        (WHOLE.replace(b"IHDR", b"JHDR"), "got a broken one: cannot identify image file"),
        (WHOLE[:50] + b"\0\0\0\0\0\0\0\0" + WHOLE[58:], "got a broken one: "),
        (encode_png(100000, 100000, 8, 0, b"\0" * 1000), "at most 64 million"),
        (encode_png(9000, 9000, 8, 0, b"\0" * 1000), "expected at most 64 million"),
        (encode_png(0, 5, 8, 0, b""), "got a broken one: "),
        (encode_png(8000, 8000, 16, 6, b"\0" * 10**6), "got a broken one: image file is truncated"),
        (encode_png(2, 2, 3, 0, b"\0\0\0\0"), "got a broken one: "),
        (encode_png(2, 2, 8, 5, b"\0\0\0\0\0\0"), "PNG"),
        (WHOLE[:33] + build_chunk(b"iCCP", b"") + WHOLE[33:], "got a broken one: cannot identify image file"),
    ],
    ids=map(str, range(99)),
)  # fmt: skip
def test_invalid_pictures_are_rejected(tmp_path: Path, data: bytes, expected: str) -> None:
    with pytest.raises(MapError) as caught:
        read(tmp_path, data)
    message = str(caught.value)
    assert message.startswith("picture: ")
    assert expected in message
    assert "\n" not in message


@settings(deadline=None, max_examples=count_examples(150))
@given(st.integers(8, len(WHOLE) - 1), st.integers(0, 255), st.booleans())
def test_a_changed_byte_gives_a_picture_or_a_map_error(
    tmp_path_factory: pytest.TempPathFactory, at: int, byte: int, cut: bool
) -> None:
    data = WHOLE[:at] if cut else WHOLE[:at] + bytes((byte,)) + WHOLE[at + 1 :]
    try:
        picture = read(tmp_path_factory.getbasetemp(), data)
    except MapError as error:
        assert "\n" not in str(error)
        return
    assert picture.level.shape == (40, 30)
