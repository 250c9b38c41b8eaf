"""Mutate inputs: flip, cut and repeat bytes, replace numbers, insert tokens, and combine files."""

import gzip
import re
import zlib
from random import Random

from fuzz_seeds import TOKENS, Case, build_chunk

MAX_INPUT_BYTES = 200_000
"""Maximum length of an input: longer ones are slow and find nothing more."""

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
    """Return a case with one or several random changes in one of its files."""
    name = random.choice(list(case.files))
    content = case.files[name]
    if name.endswith(".png") and random.random() < 0.7:
        return case.with_file(name, _change_picture(content, target, random))
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        content = _change(content, name, target, corpus, random)[:MAX_INPUT_BYTES]
    if name.endswith(".svg") and random.random() < 0.03:
        content = gzip.compress(content)
    return case.with_file(name, content)


def _change(content: bytes, name: str, target: str, corpus: list[Case], random: Random) -> bytes:
    """Apply a random mutation to the content of a file."""
    mutation = random.choice(_MUTATIONS)
    if mutation is _cross:
        other = random.choice(corpus)
        other_content = other.files.get(name, other.files[other.main])
        return _cross(content, other_content, random)
    if mutation is _splice:
        token = random.choice(TOKENS[target]).encode("utf-8", "surrogatepass")
        return _splice(content, token, random)
    return mutation(content, random)


def _choose_span(content: bytes, random: Random, max_length: int = 200) -> tuple[int, int]:
    """Return the start and the end of a random part."""
    start = random.randrange(len(content) + 1)
    return start, min(start + random.randrange(1, max_length), len(content))


def _flip_bits(content: bytes, random: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 8)) if changed else 0):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _overwrite(content: bytes, random: Random) -> bytes:
    start, end = _choose_span(content, random, 6)
    return content[:start] + random.randbytes(end - start) + content[end:]


def _cut(content: bytes, random: Random) -> bytes:
    start, end = _choose_span(content, random)
    return content[:start] + content[end:]


def _truncate(content: bytes, random: Random) -> bytes:
    return content[: random.randrange(len(content) + 1)]


def _repeat(content: bytes, random: Random) -> bytes:
    start, end = _choose_span(content, random, 60)
    return content[:end] + content[start:end] * random.choice((1, 1, 2, 10, 300)) + content[end:]


def _move(content: bytes, random: Random) -> bytes:
    start, end = _choose_span(content, random)
    remaining = content[:start] + content[end:]
    index = random.randrange(len(remaining) + 1)
    return remaining[:index] + content[start:end] + remaining[index:]


def _replace_number(content: bytes, random: Random) -> bytes:
    numbers = list(_NUMBER.finditer(content))
    if not numbers:
        return content
    number = random.choice(numbers)
    replacement = random.choice(NUMBERS)
    if random.random() < 0.3:
        values = (random.uniform(-20, 20), random.gauss(0, 1e3), random.uniform(0, 1e-3))
        replacement = repr(random.choice(values)).encode()
    return content[: number.start()] + replacement + content[number.end() :]


def _copy_number(content: bytes, random: Random) -> bytes:
    """Replace a number by another one of the file: coincident coordinates are hard cases of geometry."""
    numbers = list(_NUMBER.finditer(content))
    if len(numbers) < 2:
        return content
    replaced, source = random.sample(numbers, 2)
    return content[: replaced.start()] + source[0] + content[replaced.end() :]


def _change_line(content: bytes, random: Random) -> bytes:
    """Duplicate or remove a line."""
    lines = content.split(b"\n")
    index = random.randrange(len(lines))
    if random.random() < 0.5:
        lines.insert(random.randrange(len(lines) + 1), lines[index])
    else:
        lines.pop(index)
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
    """Insert a part of another file, or replace a part by it."""
    start, end = _choose_span(other, random)
    replaced_start, replaced_end = _choose_span(content, random)
    is_replacing = random.random() < 0.5
    rest_start = replaced_end if is_replacing else replaced_start
    return content[:replaced_start] + other[start:end] + content[rest_start:]


def _splice(content: bytes, token: bytes, random: Random) -> bytes:
    """Insert a token once or repeatedly."""
    index = random.randrange(len(content) + 1)
    return content[:index] + token * random.choice((1, 1, 1, 1, 2, 1000)) + content[index:]


_MUTATIONS = (
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


_IMAGE_SIZES = (0, 1, 2, 3, 12, 24, 25, 65_535, 10**6, 2**31 - 1, 2**31, 2**32 - 1)
_CHUNK_KINDS = (b"PLTE", b"tRNS", b"IDAT", b"iCCP", b"zTXt", b"gAMA", b"acTL", b"fcTL", b"IEND")


def _change_picture(content: bytes, target: str, random: Random) -> bytes:
    """Change a chunk of a PNG, with a valid checksum: readers reject all others at once."""
    chunks = _split_chunks(content)
    if not chunks:
        return _flip_bits(content, random)
    index = random.randrange(len(chunks))
    kind, data = chunks[index]
    choice = random.random()
    if kind == b"IDAT" and choice < 0.7:
        try:
            data = zlib.compress(_change_plain(zlib.decompress(data), random))
        except zlib.error:
            data = _flip_bits(data, random)
    elif kind == b"IHDR" and choice < 0.9:
        data = _change_header(data, random)
    elif choice < 0.8:
        data = _change_plain(data, random)
    elif choice < 0.9:
        new_kind = random.choice(_CHUNK_KINDS)
        new_index = random.randrange(len(chunks) + 1)
        chunks.insert(new_index, (new_kind, zlib.compress(bytes(random.choice((3, 768, 10**6))))))
        return _join_chunks(chunks)
    else:
        chunks.pop(index)
        return _join_chunks(chunks)
    chunks[index] = (kind, data)
    return _join_chunks(chunks)


def _change_header(data: bytes, random: Random) -> bytes:
    """Replace the width or the height of a PNG, and sometimes the depth and the color type as well."""
    size = random.choice(_IMAGE_SIZES).to_bytes(4, "big")
    offset = random.choice((0, 4))
    data = data[:offset] + size + data[offset + 4 :]
    if random.random() < 0.5:
        depth = random.choice((1, 2, 4, 8, 16, 3))
        color_type = random.randrange(8)
        data = data[:8] + bytes([depth, color_type, *random.choices((0, 1), k=3)])
    return data


def _change_plain(content: bytes, random: Random) -> bytes:
    mutation = random.choice((_flip_bits, _overwrite, _cut, _truncate, _repeat, _move))
    return mutation(content, random)[:MAX_INPUT_BYTES]


def _split_chunks(content: bytes) -> list[tuple[bytes, bytes]]:
    """Return the kinds and the data of the chunks of a PNG."""
    chunks = []
    offset = 8
    while offset + 12 <= len(content):
        length = int.from_bytes(content[offset : offset + 4], "big")
        chunks.append((content[offset + 4 : offset + 8], content[offset + 8 : offset + 8 + length]))
        offset += 12 + length
    return chunks


def _join_chunks(chunks: list[tuple[bytes, bytes]]) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + b"".join(build_chunk(kind, data) for kind, data in chunks)
