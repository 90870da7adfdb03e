"""What attacks put into files: hostile values, and damage to texts and bytes."""

import random
from collections.abc import Iterator, Mapping

MARKUP = (
    "<script>alert(1)</script>",
    '<iframe srcdoc="<script>parent.document.title=1</script>"></iframe>',
    "![](http://127.0.0.1:9/x)",
    "[x](javascript:alert(1))",
    "{{7*7}} ${7*7} %s %n",
)
ESCAPES = (
    "\x1b]0;owned\x07",
    "\x1b[2J\x1b[H",
    "\x9b31m",
    "\u202eyaml.evil",
    "\u2066\u2028\u2029",
    "\r\x08\x7f",
    "\x00",
    "\ufeff\u200b",
    "\ud7ff\ue000\U000e0001",
)
LONG = ("x" * 10_000, "long name " * 1000, "é" * 300)


def quoted(text: str) -> str:
    """A text as YAML has it in double quotes."""
    return '"' + "".join(c if " " <= c <= "~" and c not in '"\\' else f"\\U{ord(c):08x}" for c in text) + '"'


# values of a field as YAML has them
VALUES = (
    *(".nan", ".inf", "-.inf", "nan mm", "inf m", "-1", "-1 mm", "0", "0 m", "1e308", "-1e308 kg/m3", "1e999"),
    "1e-320 m",
    *("1" + 400 * "0", "1" * 5000, '""', '" "', "null", "true", "[]", "{}", "[1, 2]", "[[[[1]]]]", "{a: 1}"),
    "{kind: glue}",
    *("3 parsec", "7.4 MP", "3 m m", "3 kg m s", "3", "1..2", "2..1 m", "1_000", "0x1F", "2026-01-01"),
    *("12:30:45", "1,5 m"),
    *("../../../etc/passwd", "/dev/zero", "/proc/self/environ", "https://127.0.0.1:9/x", "~root", "a*b?[c]"),
    *("__class__", "__init__", "self.__dict__", "$(true)", "`true`", "; true", "' OR 1=1", "%00"),
    *("&a [*a]", "*nobody", "!!python/object/apply:os.system [true]", "!!binary aGVsbG8=", "!x 3", "<<: 3"),
    "{? [a]: 1}",
    *("[" * 40 + "]" * 40, "[" * 3000, "{a: " * 2000, "[" + "1, " * 3000 + "1]", "[" + "1, " * 30_000 + "1]"),
    *map(quoted, (*MARKUP, *ESCAPES, *LONG)),
)  # fmt: skip
KEYS = ("clr", "__class__", '""', "null", "3", "? [a, b]\n", *map(quoted, (*MARKUP, *ESCAPES, *LONG)))
# values that repeat each other, a thousand million in all
_LAUGHS = "a0: &a0 [x]\n" + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 10))
# whole files in place of a good one
TEXTS = (
    *("", "\n\n", "3", "- 1", "null", "...", "---\n---\n", "# nothing", "a: 1\na: 2", "\tname: x"),
    "%YAML 9.9\n---\na: 1",
    _LAUGHS,
    *("a: &a {b: *a}", "&a [*a]", "x: [" * 900, "- " * 5000 + "1", "[" * 100_000, "a:\n" + " " * 100_000 + "b: 1"),
    *("a: [" + "1," * 490_000 + "]", "-\n" * 300_000, "x" * 1_000_001, "name: |\n" + "  y\n" * 100_000),
    *("<!doctype html><html><body>404</body></html>", '{"name": "x", "body": {}}', "services: {web: {image: nginx}}"),
)  # fmt: skip
FOREIGN = (
    *(bytes(range(256)), bytes(500), b"\xff\xfe\x00", b"\x1f\x8b\x08\x00", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n"),
    b"\x7fELF",
    *(b"CDF\x01", b"MATLAB 5.0 MAT-file".ljust(128, b"\0"), b"\x93NUMPY\x01\x00", b"TDSm" + bytes(24), b"%PDF-1.7"),
)  # fmt: skip


def damaged_text(text: str, rng: random.Random) -> tuple[str, bytes]:
    """A text with damage of one kind, and what it is."""
    raw, lines = text.encode(), text.splitlines(keepends=True)
    n, k = rng.randrange(len(raw)), rng.randrange(len(lines))
    how = rng.randrange(9)
    if how == 0:
        return f"breaks off after {n} bytes", raw[:n]
    if how == 1:
        return f"line {k + 1} twice", "".join([*lines[: k + 1], *lines[k:]]).encode()
    if how == 2:
        return f"line {k + 1} lost", "".join(lines[:k] + lines[k + 1 :]).encode()
    if how == 3:
        return f"line {k + 1} shifted", "".join([*lines[:k], " " * rng.randint(1, 9), *lines[k:]]).encode()
    if how == 4:
        return f"line {k + 1} without its colon", "".join(
            [*lines[:k], lines[k].replace(":", "", 1), *lines[k + 1 :]]
        ).encode()
    if how == 5:
        return f"no UTF-8 at byte {n}", raw[:n] + rng.choice((b"\xff", b"\xc3\x28", b"\xed\xa0\x80", b"\x80")) + raw[n:]
    if how == 6:
        coding = rng.choice(("utf-16", "utf-32", "utf-7", "cp037"))
        return f"in {coding}", text.encode(coding, "replace")
    if how == 7:
        other = rng.choice("\t:{[-&*!|>%@`\x00\x1b\x85\u2028é#\"'")
        return f"{other!r} at byte {n}", raw[:n] + other.encode() + raw[n:]
    return damaged_bytes(raw, rng)


def damaged_bytes(raw: bytes, rng: random.Random) -> tuple[str, bytes]:
    """Bytes with damage of one kind, and what it is."""
    n, size = rng.randrange(len(raw)), rng.randint(1, 64)
    how = rng.randrange(7)
    if how == 0:
        return f"breaks off after {n} bytes", raw[:n]
    if how == 1:
        return f"bytes from {n} lost", raw[:n] + raw[n + size :]
    if how == 2:
        return f"zeros from {n}", raw[:n] + bytes(min(size, len(raw) - n)) + raw[n + size :]
    if how == 3:
        return f"noise from {n}", raw[:n] + rng.randbytes(size) + raw[n + size :]
    if how == 4:
        return f"noise put in at {n}", raw[:n] + rng.randbytes(size) + raw[n:]
    changed, flips = bytearray(raw), rng.choice((1, 1, 3, 30))
    head = rng.random() < 0.5  # where what says what is in a file stands
    for _ in range(flips):
        changed[rng.randrange(min(len(raw), 600) if head else len(raw))] ^= 1 << rng.randrange(8)
    return f"{flips} bits flipped", bytes(changed)


def spoilt_files(
    rng: random.Random, count: int, good: Mapping[str, tuple[str, bytes]]
) -> Iterator[tuple[str, str, bytes]]:
    """Good files by a name of each, in turn, damaged, foreign or with the ending of another: about, file, contents."""
    endings = sorted({file.partition(".")[2] for file, _ in good.values()})
    for k in range(count):
        name = [*good][k % len(good)]
        file, raw = good[name]
        if rng.random() < 0.1:
            about, raw = "foreign", rng.choice(FOREIGN)
        elif rng.random() < 0.1:
            about, file = "another ending", f"a.{rng.choice(endings)}"
        else:
            about, raw = damaged_bytes(raw, rng)
        yield f"{name}: {about}", file, raw
