"""Tables as spreadsheets and scripts write them: marks, blank rows, limits, and damage in one sentence."""

import gzip
from pathlib import Path

import pytest

from lpc_mdo.files.tables import parse_table, read_table

FAULTS = Path(__file__).parents[1] / "faults"


@pytest.mark.parametrize(
    "text",
    [
        "a,b\n1.5,2\n",
        "a,b\r\n1.5,2\r\n\r\n\r\n",
        "a,b\r1.5,2\r",
        "\ufeffa,b\n1.5,2",
        "\n\na , b\n\n 1.5 , 2\n,\n  \n",
        "a;b\n1,5;2\n;\n",
        "a\tb\n1,5\t2\n",
        '"a","b"\n"1.5","2"\n',
    ],
)
def test_one_table_is_read_from_whatever_marks_it_has(tmp_path, text):
    for name, data in (("t.csv", text.encode()), ("t.csv.gz", gzip.compress(text.encode()))):
        (tmp_path / name).write_bytes(data)
        table = read_table(tmp_path / name)
        assert table.header == ("a", "b")
        assert [cells for _, cells in table.rows] == [("1.5", "2")]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            b"a,b\n1,2\n1,2,3\n",
            "line 3: 3 cells are invalid: it must have 2, as the header; decimal commas need semicolons",
        ),
        (b"a,b\n1\n", "line 2: 1 cells are invalid"),
        (b"a,a\n1,2\n", "column 'a' is invalid: it must stand once"),
        (b"a,b\n" + b"1" * 200_000 + b",2\n", r"line 2 is invalid: field larger than field limit \(131072\)"),
        (b'a,b\n"1,2\n', "is invalid: unexpected end of data"),
        (b"a,b\n1,\x00\n", "NUL"),
        (b"a,b\n1,\xff\n", "not UTF-8"),
        (b"a\n" * 1_000_002, "more than 1000000 lines are invalid"),
    ],
)
def test_damaged_tables_are_refused_in_one_sentence(tmp_path, data, message):
    file = tmp_path / "t.csv"
    file.write_bytes(data)
    with pytest.raises(ValueError, match=message) as caught:
        read_table(file)
    assert "t.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_bomb_and_a_broken_stream_are_refused(tmp_path):
    file = tmp_path / "t.csv.gz"
    file.write_bytes(gzip.compress(b"0" * 80_000_000))
    with pytest.raises(ValueError, match="unpacks to more than 64000000 bytes"):
        read_table(file)
    file.write_bytes(gzip.compress(b"a,b\n1,2\n")[:-9])
    with pytest.raises(ValueError, match="gzip"):
        read_table(file)
    with pytest.raises(ValueError, match="/dev/zero"):
        read_table(Path("/dev/zero"))


def test_decimal_commas_between_commas_shift_no_column():
    text = (FAULTS / "samples_decimal_comma.csv").read_text()
    with pytest.raises(
        ValueError, match="line 2: 9 cells are invalid: it must have 8, as the header; decimal commas need"
    ):
        parse_table(text, "design.csv")
