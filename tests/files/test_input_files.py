"""Files are read within bounds of size, depth and memory, and what is not read is refused in one sentence."""

import gzip
import os
from pathlib import Path

import pytest
from conftest import FAULTS

from lpc_mdo.files.read import (
    JSON_LIMIT,
    ConfigurationError,
    parse_toml,
    read_csv_rows,
    read_json,
    read_text,
    read_toml,
    unzipped,
)


def refusal(read, *arguments):
    with pytest.raises(ConfigurationError) as told:
        read(*arguments)
    sentence = str(told.value)
    assert len(sentence.splitlines()) == 1
    return sentence


def written(folder, content, name="file"):
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.mark.parametrize("read", [read_text, read_json, read_toml, read_csv_rows])
def test_what_is_no_file_is_refused_without_waiting(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    assert "pipe" in refusal(read, tmp_path / "pipe")
    assert "device" in refusal(read, Path("/dev/zero"))
    assert "Is a directory" in refusal(read, tmp_path)
    assert "No such file" in refusal(read, tmp_path / "nothing")
    assert "null byte" in refusal(read, Path("a\0b"))


@pytest.mark.parametrize("read", [read_text, read_json, read_toml, read_csv_rows])
def test_what_is_not_text_is_refused(tmp_path, read):
    assert "not UTF-8 text" in refusal(read, written(tmp_path, b"\xff\xfea\0"))
    assert "NUL" in refusal(read, written(tmp_path, "a\0b"))


def test_a_byte_order_mark_is_left_out(tmp_path):
    assert read_json(written(tmp_path, b'\xef\xbb\xbf{"a": 1}')) == {"a": 1}
    assert read_toml(written(tmp_path, b"\xef\xbb\xbfa = 1"))[0] == {"a": 1}
    assert read_csv_rows(written(tmp_path, b"\xef\xbb\xbfa,b\n1,2\n")) == [{"a": "1", "b": "2"}]


def test_line_ends_of_every_system_are_read(tmp_path):
    for end in ("\n", "\r\n", "\r"):
        assert read_csv_rows(written(tmp_path, end.join(["a,b", "1,2", "", "3,4"]))) == [
            {"a": "1", "b": "2"},
            {"a": "3", "b": "4"},
        ]


def test_files_above_the_limit_are_refused_with_both_sizes(tmp_path):
    assert "it has 101 bytes; it must have at most 100" in refusal(read_text, written(tmp_path, "a" * 101), 100)


def test_a_compressed_bomb_is_not_unpacked(tmp_path):
    data = gzip.compress(bytes(40_000_000))
    assert f"unpacks to more than {JSON_LIMIT} bytes" in refusal(unzipped, data, Path("bomb.gz"))
    assert read_text(written(tmp_path, gzip.compress(b"a") + gzip.compress(b"b"), "two.gz")) == "ab"


def test_a_broken_gzip_stream_is_refused():
    data = gzip.compress(b"abc" * 100)
    assert "ends too soon" in refusal(unzipped, data[:-6], Path("cut.gz"))
    assert "not gzip data" in refusal(unzipped, b"abc", Path("text.gz"))
    assert "damaged" in refusal(unzipped, data[:10] + b"\xff\xff\xff" + data[13:], Path("text.gz"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('{"a": {"b": 1, "c": 2, "b": 1}}', "b is given twice"),
        ("[" * 100_000, "at most 32 lists or tables"),
        ("[" * 40 + "]" * 40, "at most 32 lists or tables"),
        ('{"a": [0, {"b": NaN}]}', "a[1].b = nan is invalid: it must be a finite number"),
        ('{"a": -Infinity}', "a = -inf is invalid"),
        ('{"a": 1e999}', "a = inf is invalid"),
        ('{"a": -' + "1" * 5000 + "}", "a = -inf is invalid"),
        ("[" + "0," * 1_000_000 + "0]", "more than 1000000 values"),
        ("", "is not valid JSON"),
        ("{'a': 1}", "is not valid JSON"),
    ],
)
def test_json_that_is_no_json_or_too_much_is_refused(tmp_path, text, sentence):
    assert sentence in refusal(read_json, written(tmp_path, text))


def test_whole_numbers_beyond_64_bits_are_floats(tmp_path):
    content = read_json(written(tmp_path, f"[{2**62}, {2**70}, {-(2**70)}, 3]"))
    assert content == [2**62, 2.0**70, -(2.0**70), 3]
    assert [type(value) for value in content[1:]] == [float, float, int]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a = " + "[" * 1500 + "]" * 1500, "line 1 opens a list or table within 32 others"),
        ("a = " + "[\n" * 300_000, "line 33 opens"),
        ("a = " + "{b=" * 500 + "1" + "}" * 500, "line 1 opens"),
        ("\n" + ".".join("a" * 1000) + " = 1", "line 2 holds a key of more than 8 parts"),
        ("[" + " . ".join(["'a.b'"] * 300) + "]", "line 1 holds a key of more than 8 parts"),
        ("a = '" + "x" * 5000 + "'", "line 1 has 5006 characters"),
        ("a = 1\na = 2", "is not valid TOML"),
        ("a = 2023-02-31", "is not valid TOML"),
    ],
)
def test_toml_that_would_not_end_is_refused_before_it_is_parsed(text, sentence):
    assert sentence in refusal(parse_toml, text, "mine.toml")


def test_brackets_and_dots_in_text_and_comments_are_none_of_toml():
    text = f'a = \'{"[" * 50}\'  # {"a." * 50} {"[" * 50}\nb = """\n{"[" * 50}\n"""\nc = "{"b." * 50}"'
    assert parse_toml(text, "mine.toml")["a"] == "[" * 50


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a,b\n1,2,3\n", "line 2 has 3 values; it must have 2"),
        ("a,b\n1\n", "line 2 has 1 values; it must have 2"),
        ("a,a\n1,2\n", "column 'a' stands twice"),
        ("\n\n", "is empty"),
        ("a,b\n" + "1" * 200_000 + ",2\n", "line 2 is not valid CSV"),
        ('a,b\n"1,2\n', "is not valid CSV"),
        ("a\n" + "1\n" * 1_000_001, "more than 1000000 lines"),
    ],
)
def test_tables_that_are_none_are_refused(tmp_path, text, sentence):
    assert sentence in refusal(read_csv_rows, written(tmp_path, text))


def test_brackets_within_brackets_are_refused_before_the_parser_meets_them():
    with pytest.raises(ConfigurationError, match="line 1 opens a list or table within 32 others; fewer must be nested"):
        read_toml(FAULTS / "deep_array.toml")
