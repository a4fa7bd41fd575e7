"""The schemas are what is written, and no reader is left behind when they change.

`GRADER_REGENERATE=1 pytest tests/report/file_formats` writes docs/reference/formats.md and its schemas again, and
refuses where a change takes a new version.
"""

from __future__ import annotations

import json
import os
import re
from functools import cache
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator, FormatChecker
from mcap.reader import make_reader

from grader.cli.main import run
from grader.evidence.events import METADATA_NAME, PACKAGE_TOPIC, TOPICS
from grader.evidence.reader import load_run
from grader.model import version
from grader.report.file_formats import FORMATS, ROOTS, Addition, records_in, schema_of
from grader.results import RESULT
from scripts.reference.formats import METADATA, PAGE, SCHEMAS, format_pages
from tests.report.file_formats.guard import copy_of, faults
from tests.report.file_formats.kept import CLASS, FOLDER, ROOT

REFERENCE = ROOT / "docs" / "reference"
PAGES = [PAGE, *(f"{SCHEMAS}/{name}.schema.json" for name in FORMATS)]
EVIDENCE = sorted(FOLDER.rglob("*.mcap"))
RESULTS = sorted([*FOLDER.rglob(RESULT), *(ROOT / "tests" / "report").rglob("golden/" + RESULT)])
LABS = sorted([*(ROOT / "rubrics").glob("*.yaml"), *(ROOT / "rubrics" / "examples").glob("*.yaml")])
named = pytest.mark.parametrize("name", FORMATS)
made = cache(schema_of)
pages = cache(format_pages)


def validator(name: str, part: str = "") -> Draft202012Validator:
    schema = made(name)
    inner = (
        {"$schema": schema["$schema"], "$ref": f"#/$defs/{part}", "$defs": schema["$defs"]}
        if part
        else schema
    )
    return Draft202012Validator(inner, format_checker=FormatChecker())


@named
def test_it_is_a_schema_that_says_what_it_is(name: str) -> None:
    Draft202012Validator.check_schema(made(name))
    assert made(name)["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert made(name)["$id"] == f"urn:ros-lab-grader:{name}:{FORMATS[name].is_.version}"
    assert str(FORMATS[name].is_) in made(name)["title"]
    assert len({schema["$id"] for schema in map(made, FORMATS)}) == len(FORMATS)


def test_every_format_is_in_the_list() -> None:
    assert [about.is_ for about in FORMATS.values()] == list(version.ALL)


@pytest.mark.parametrize("name", [name for name in ROOTS if name not in {"course", "mutants", "rubric"}])
def test_what_is_written_names_its_version(name: str) -> None:
    assert ROOTS[name].model_fields["schema_"].default == str(FORMATS[name].is_)
    assert "schema" in made(name)["required"]


@named
def test_what_was_added_is_there_and_may_be_missing(name: str) -> None:
    records = dict(records_in(name, made(name)))
    for addition in FORMATS[name].additions:
        if " " in addition.key:
            continue  # metadata, or a topic
        record, _, key = addition.key.partition(".")
        assert key in records[record]["properties"], addition
        assert key not in records[record].get("required", ()), addition


@pytest.mark.parametrize("name", ["result", "run", "overrides", "evidence"])
def test_every_key_has_its_words(name: str) -> None:
    silent = [
        f"{record}.{key}"
        for record, schema in records_in(name, made(name))
        if name != "evidence" or record in EVENTS
        for key, found in schema.get("properties", {}).items()
        if "description" not in found
    ]
    assert silent == [], "the docstring of a field says what its key means"


EVENTS = {record.__name__ for record in TOPICS.values()} | {"Connection"}


@pytest.mark.parametrize("path", RESULTS, ids=[str(path.relative_to(ROOT)) for path in RESULTS])
def test_every_result_fits(path: Path) -> None:
    assert list(validator("result").iter_errors(json.loads(path.read_bytes()))) == []


def test_a_class_fits() -> None:
    assert list(validator("run").iter_errors(json.loads((CLASS / "run.json").read_bytes()))) == []
    validator("overrides").validate(
        json.loads(json.dumps(yaml.safe_load((CLASS / "overrides.yaml").read_text()), default=str))
    )
    lines = [json.loads(line) for line in (CLASS / "results.jsonl").read_text().splitlines()]
    assert lines
    for line in lines:
        validator("result").validate(line)


@pytest.mark.parametrize("path", EVIDENCE[::3], ids=[str(path.relative_to(FOLDER)) for path in EVIDENCE[::3]])
def test_every_message_of_the_graders_own_fits(path: Path) -> None:
    checked = 0
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            if channel.message_encoding == "json" and channel.topic.startswith("/grader/"):
                assert schema is not None
                record = made("evidence")["properties"][channel.topic]["$ref"].rpartition("/")[2]
                assert schema.name == f"grader.{record}"
                FITS.setdefault(record, validator("evidence", record)).validate(json.loads(message.data))
                checked += 1
    assert checked


FITS: dict[str, Draft202012Validator] = {}


def test_every_metadata_key_is_described() -> None:
    found = {key for path in EVIDENCE for key in load_run(path).metadata}
    assert found <= METADATA.keys()
    assert version.EVIDENCE.name == METADATA_NAME


@pytest.mark.full
@pytest.mark.parametrize("path", LABS, ids=[path.stem for path in LABS])
def test_every_rubric_fits_but_for_checks_of_its_own(path: Path) -> None:
    data = yaml.safe_load(path.read_text())
    if "checks" in data:
        pytest.skip("it has checks of its own, of which only its own schema knows")
    assert list(validator("rubric").iter_errors(data)) == []
    del data["schema"]
    assert list(validator("rubric").iter_errors(data)) == []


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("result", {}),
        ("result", {"schema": "grader.result/2"}),
        ("run", {"schema": "grader.run/1"}),
        ("overrides", {"ada": {"build": {"author": "who decides nothing"}}}),
        ("overrides", {"ada": {"build": 5}}),
        ("overrides", {"schema": "grader.overrides/2"}),
        ("rubric", {"schema": "grader.rubric/1"}),
    ],
)
def test_what_is_none_does_not_fit(name: str, data: object) -> None:
    assert not validator(name).is_valid(data)


def test_a_later_graders_keys_fit_and_a_persons_do_not() -> None:
    result = json.loads(RESULTS[0].read_bytes())
    validator("result").validate(result | {"later": 1})
    assert not validator("overrides").is_valid({"ada": {"build": {"points": 1, "later": 1}}})


@pytest.mark.full
@pytest.mark.parametrize("path", PAGES)
def test_what_is_in_the_docs_is_what_the_code_says(path: str) -> None:
    file = REFERENCE / path
    if os.environ.get("GRADER_REGENERATE"):
        name = file.name.removesuffix(".schema.json")
        if file.exists() and name in FORMATS:
            assert faults(name, json.loads(file.read_bytes()), made(name), FORMATS[name]) == []
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(pages()[path])
    assert file.read_text() == pages()[path], (
        "GRADER_REGENERATE=1 pytest tests/report/file_formats writes it again"
    )


@named
def test_no_change_is_unannounced(name: str) -> None:
    """The schema in the docs is that of the last commit that said what changed."""
    written = json.loads((REFERENCE / "schemas" / f"{name}.schema.json").read_bytes())
    assert faults(name, written, made(name), FORMATS[name]) == []


@pytest.mark.parametrize(
    ("name", "place", "change", "fault"),
    [
        ("result", "GradingResult", lambda keys: keys.pop("points"), "GradingResult.points is gone"),
        ("result", "Note", lambda keys: keys["kind"]["enum"].append("odd"), "Note.kind is of another type"),
        ("result", "TimingInfo", lambda keys: keys["wall_s"].update(type="integer"), "TimingInfo.wall_s is of"),
        ("result", "Note", lambda keys: keys.update(weight={"type": "number"}), "Note.weight is new: list it"),
        ("evidence", "HostEvent", lambda keys: keys.pop("busy"), "HostEvent.busy is gone"),
        ("rubric", "Late", lambda keys: keys["per"].update(enum=["day"]), "Late.per is of another type"),
        ("rubric", "Late", lambda keys: keys.pop("cap"), "Late.cap is gone"),
    ],
)  # fmt: skip
def test_the_guard_finds(name: str, place: str, change, fault: str) -> None:
    new = copy_of(made(name))
    change(dict(records_in(name, new))[place]["properties"])
    found = faults(name, made(name), new, FORMATS[name])
    assert len(found) == 1
    assert found[0].startswith(fault)


def test_the_guard_finds_what_has_to_be_there_now() -> None:
    new = copy_of(made("result"))
    new["required"].append("notes")
    assert faults("result", made("result"), new, FORMATS["result"]) == [
        "GradingResult.notes has to be there now, and files of before may lack it"
    ]


@pytest.mark.parametrize(
    ("name", "place", "change"),
    [
        ("rubric", "Late", lambda keys: keys["per"]["enum"].append("week")),
        ("rubric", "Late", lambda keys: keys.update(mercy={"type": "number"})),
        ("result", "Note", lambda keys: keys["text"].update(description="other words")),
    ],
)
def test_the_guard_lets_pass(name: str, place: str, change) -> None:
    new = copy_of(made(name))
    change(dict(records_in(name, new))[place]["properties"])
    assert faults(name, made(name), new, FORMATS[name]) == []


def test_the_guard_lets_pass_what_is_listed_and_a_new_version() -> None:
    new = copy_of(made("result"))
    new["$defs"]["Note"]["properties"]["weight"] = {"type": "number"}
    about = FORMATS["result"]
    listed = copy_with(about, Addition(1, "Note.weight", "It weighs nothing."))
    assert faults("result", made("result"), new, listed) == []
    assert faults("result", made("result"), {"$id": "urn:ros-lab-grader:result:2"}, about) == []


def copy_with(about, addition: Addition):
    from dataclasses import replace  # noqa: PLC0415 - here alone

    return replace(about, additions=(*about.additions, addition))


@named
def test_the_command_prints_it(name: str, capsys) -> None:
    assert run(["schema", name]) == 0
    assert json.loads(capsys.readouterr().out) == made(name)


def test_the_command_lists_them(capsys) -> None:
    assert run(["schema"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines] == [[n, str(about.is_)] for n, about in FORMATS.items()]


def test_a_format_that_there_is_not(capsys) -> None:
    assert run(["schema", "marks"]) == 2
    assert re.search(r"choose from .*result", capsys.readouterr().err)


def test_the_package_topic_is_among_them() -> None:
    assert set(made("evidence")["properties"]) == {*TOPICS, PACKAGE_TOPIC}
