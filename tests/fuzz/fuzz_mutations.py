"""Changes of inputs: bytes flipped, cut, repeated; numbers made extreme; words spliced in; files crossed."""

import gzip
import re
import zlib
from random import Random

from fuzz_seeds import TOKENS, Case, build_chunk

MOST = 200_000
"""Longest input in bytes: long ones are slow, and find nothing that short ones do not."""

NUMBERS = [
    *(
        b"0",
        b"-0",
        b"-0.0",
        b"1",
        b"-1",
        b"2",
        b"1e-3",
        b"9.99e-4",
        b"0.1",
        b"1e-320",
        b"1e308",
        b"-1e308",
        b"1e999",
    ),
    *(
        b"NaN",
        b"nan",
        b"inf",
        b"-Infinity",
        b"1e7",
        b"1.00001e7",
        b"10000",
        b"10000.1",
        b"2147483648",
        b"-2147483649",
    ),
    *(
        b"4294967296",
        b"9" * 20,
        b"9" * 400,
        b"0x10",
        b"1_0",
        b"01",
        b"1.",
        b".5",
        b"+1",
        b"1e",
        b"--1",
        b"1,5",
        b"\xef\xbc\x91",
    ),
    *(b"0.30000000000000004", b"1e-7", b"100000", b"65536", b"", b"null", b'"1"', b"[]", b"true"),
]
"""Replacements of numbers."""

_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def mutate(case: Case, target: str, corpus: list[Case], random: Random) -> Case:
    """Return a case with one to a few changes of one of its files."""
    name = random.choice(list(case.files))
    content = case.files[name]
    if name.endswith(".png") and random.random() < 0.7:
        return case.with_file(name, _change_picture(content, target, random))
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        content = _change(content, name, target, corpus, random)[:MOST]
    if name.endswith(".svg") and random.random() < 0.03:
        content = gzip.compress(content)
    return case.with_file(name, content)


def _change(content: bytes, name: str, target: str, corpus: list[Case], random: Random) -> bytes:
    way = random.choice(_WAYS)
    if way is _cross:
        other = random.choice(corpus)
        beside = other.files.get(name, other.files[other.main])
        return _cross(content, beside, random)
    if way is _splice:
        return _splice(content, random.choice(TOKENS[target]).encode("utf-8", "surrogatepass"), random)
    return way(content, random)


def _choose_span(content: bytes, random: Random, longest: int = 200) -> tuple[int, int]:
    begin = random.randrange(len(content) + 1)
    return begin, min(begin + random.randrange(1, longest), len(content))


def _flip_bits(content: bytes, random: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 8)) if changed else 0):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _overwrite(content: bytes, random: Random) -> bytes:
    begin, end = _choose_span(content, random, 6)
    return content[:begin] + random.randbytes(end - begin) + content[end:]


def _cut(content: bytes, random: Random) -> bytes:
    begin, end = _choose_span(content, random)
    return content[:begin] + content[end:]


def _truncate(content: bytes, random: Random) -> bytes:
    return content[: random.randrange(len(content) + 1)]


def _repeat(content: bytes, random: Random) -> bytes:
    begin, end = _choose_span(content, random, 60)
    return content[:end] + content[begin:end] * random.choice((1, 1, 2, 10, 300)) + content[end:]


def _move(content: bytes, random: Random) -> bytes:
    begin, end = _choose_span(content, random)
    rest = content[:begin] + content[end:]
    at = random.randrange(len(rest) + 1)
    return rest[:at] + content[begin:end] + rest[at:]


def _replace_number(content: bytes, random: Random) -> bytes:
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    number = random.choice(found)
    new = random.choice(NUMBERS)
    if random.random() < 0.3:
        new = repr(
            random.choice((random.uniform(-20, 20), random.gauss(0, 1e3), random.uniform(0, 1e-3)))
        ).encode()
    return content[: number.start()] + new + content[number.end() :]


def _copy_number(content: bytes, random: Random) -> bytes:
    """Put one number in the place of another: what coincides is where geometry is hard."""
    found = list(_NUMBER.finditer(content))
    if len(found) < 2:
        return content
    one, other = random.sample(found, 2)
    return content[: one.start()] + other[0] + content[one.end() :]


def _change_line(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    at = random.randrange(len(lines))
    if random.random() < 0.5:
        lines.insert(random.randrange(len(lines) + 1), lines[at])
    else:
        lines.pop(at)
    return b"\n".join(lines)


def _change_encoding(content: bytes, random: Random) -> bytes:
    text = content.decode("latin-1")
    return random.choice(
        (
            content.replace(b"\n", b"\r\n"),
            content.replace(b"\n", b"\r"),
            b"\xef\xbb\xbf" + content,
            text.encode("utf-16"),
            text.encode("utf-32"),
            content.replace(b" ", "\u2003".encode()),
            content.swapcase(),
            content + b"\0" * random.choice((1, 100)),
        )
    )


def _cross(content: bytes, other: bytes, random: Random) -> bytes:
    begin, end = _choose_span(other, random)
    at, until = _choose_span(content, random)
    return content[:at] + other[begin:end] + content[until if random.random() < 0.5 else at :]


def _splice(content: bytes, token: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + token * random.choice((1, 1, 1, 1, 2, 1000)) + content[at:]


_WAYS = (
    *(_flip_bits, _overwrite, _cut, _truncate, _repeat, _move, _change_line, _change_encoding),
    *(
        _replace_number,
        _replace_number,
        _replace_number,
        _copy_number,
        _cross,
        _cross,
        _splice,
        _splice,
        _splice,
    ),
)


def _change_picture(content: bytes, target: str, random: Random) -> bytes:
    """Change a PNG between its check sums, and put them right: else nothing behind them is reached."""
    found = _split_chunks(content)
    if not found:
        return _flip_bits(content, random)
    at = random.randrange(len(found))
    kind, data = found[at]
    way = random.random()
    if kind == b"IDAT" and way < 0.7:
        try:
            data = zlib.compress(_change_plain(zlib.decompress(data), random))
        except zlib.error:
            data = _flip_bits(data, random)
    elif kind == b"IHDR" and way < 0.9:
        number = random.choice((0, 1, 2, 3, 12, 24, 25, 65_535, 10**6, 2**31 - 1, 2**31, 2**32 - 1)).to_bytes(
            4, "big"
        )
        place = random.choice((0, 4))
        data = data[:place] + number + data[place + 4 :]
        if random.random() < 0.5:
            data = data[:8] + bytes(
                [random.choice((1, 2, 4, 8, 16, 3)), random.randrange(8), *random.choices((0, 1), k=3)]
            )
    elif way < 0.8:
        data = _change_plain(data, random)
    elif way < 0.9:
        kind = random.choice(
            (b"PLTE", b"tRNS", b"IDAT", b"iCCP", b"zTXt", b"gAMA", b"acTL", b"fcTL", b"IEND")
        )
        found.insert(
            random.randrange(len(found) + 1), (kind, zlib.compress(bytes(random.choice((3, 768, 10**6)))))
        )
        return _join_chunks(found)
    else:
        found.pop(at)
        return _join_chunks(found)
    found[at] = kind, data
    return _join_chunks(found)


def _change_plain(content: bytes, random: Random) -> bytes:
    return random.choice((_flip_bits, _overwrite, _cut, _truncate, _repeat, _move))(content, random)[:MOST]


def _split_chunks(content: bytes) -> list[tuple[bytes, bytes]]:
    found = []
    at = 8
    while at + 12 <= len(content):
        length = int.from_bytes(content[at : at + 4], "big")
        found.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + length]))
        at += 12 + length
    return found


def _join_chunks(chunks: list[tuple[bytes, bytes]]) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + b"".join(build_chunk(kind, data) for kind, data in chunks)
