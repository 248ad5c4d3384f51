import json

import msgspec
import pytest

from touchdown.core import files, records
from touchdown.core.errors import UserError


class Row(msgspec.Struct, rename={"env_steps": "observations"}):
    env_steps: records.Count
    seconds: records.Seconds = 0.0


def test_a_record_has_the_names_of_the_file_and_ignores_unknown_fields(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(files.to_json({"observations": 3, "later": None}))
    assert records.decode_json(path, Row) == Row(3)


def test_a_record_is_written_as_it_is_read(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(files.to_json({"rows": [Row(3, 0.1), Row(4, 1e22)]}))
    assert records.decode_json(path, dict[str, list[Row]]) == {"rows": [Row(3, 0.1), Row(4, 1e22)]}
    assert files.to_json_line(Row(3, 1e22)) == b'{"observations": 3, "seconds": 1e+22}\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"observations": "3"}', "observations = '3': must be a whole number"),
        ('{"observations": -3}', "observations = -3: must be from 0 to 2**63 - 1"),
        ('{"observations": 3, "seconds": null}', "seconds = None: must be a number"),
        ('{"seconds": 3}', "observations: missing"),
        ("[]", "is of type list, must be an object"),
        ('{"observations": 3', "not JSON, perhaps truncated"),
        ('{"observations": NaN}', "not JSON"),
        ('{"observations": 1e999}', "not JSON"),
        (f'{{"observations": {"9" * 5_000}}}', "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"observations": ' + "[" * 100_000, "not JSON"),
        ("", "not JSON"),
    ],
)
def test_a_wrong_value_is_refused_in_one_line_that_names_the_file(tmp_path, text, said):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(UserError) as refused:
        records.decode_json(path, Row)
    assert str(refused.value).startswith(f"{path}: {said}")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("version", [2, None, "1", True, [1]])
def test_another_version_is_refused_before_its_fields_are_read(tmp_path, version):
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"format_version": version, "observations": "of another kind"}))
    with pytest.raises(UserError, match="must be 1 in this version"):
        records.decode_json(path, Row, 1)


def test_the_lines_of_a_file_are_records_and_an_unfinished_one_is_left_out(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text('{"observations": 1}\n{"observations": 2}\n{"observations": 3}')
    assert records.decode_jsonl(path, Row) == [Row(1), Row(2)]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('{"observations": 1.5}', "line 2: observations = 1.5: must be a whole number"),
        ('{"seconds": 1}', "line 2: observations: missing"),
        ('{"observations": 1} {"observations": 2}', "line 2 is not a JSON object"),
        ("", "line 2 is not a JSON object"),
        ("null", "line 2 is not a JSON object"),
        ('{"observations": NaN}', "line 2 has NaN, must have finite numbers"),
        ('{"observations": [1, -Infinity]}', "line 2 has -Infinity, must have finite numbers"),
        ('{"observations": "NaN"', "line 2 is not a JSON object"),
    ],
)
def test_a_wrong_line_is_refused_by_its_number(tmp_path, line, said):
    path = tmp_path / "rows.jsonl"
    path.write_text(f'{{"observations": 1}}\n{line}\n{{"observations": 3}}\n')
    with pytest.raises(UserError) as refused:
        records.decode_jsonl(path, Row)
    assert str(refused.value) == f"{path}: {said}"


def test_a_line_that_goes_on_in_the_next_is_refused(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text('{"observations":\n1}\n')
    with pytest.raises(UserError, match="line 1 is not a JSON object"):
        records.decode_jsonl(path, Row)


def test_values_that_were_read_otherwise_are_converted_or_refused():
    assert records.convert({"observations": 1}, Row, "my.toml") == Row(1)
    with pytest.raises(UserError, match=r"my\.toml: observations = 'a': must be a whole number"):
        records.convert({"observations": "a"}, Row, "my.toml")
    with pytest.raises(ValueError, match=r"agent\.observations: missing"):
        records.check({}, Row, "agent")
