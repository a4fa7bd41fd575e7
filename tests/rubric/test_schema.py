from __future__ import annotations

import json
from functools import cache

import pytest
import yaml
from jsonschema import Draft202012Validator

from grader.checks import CHECKS
from grader.rubric.load import all_rubrics
from grader.rubric.schema import rubric_schema
from tests.rubric.samples import SOUND


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(rubric_schema())


@pytest.mark.full
def test_the_schema_is_one():
    Draft202012Validator.check_schema(rubric_schema())
    assert json.loads(json.dumps(rubric_schema())) == rubric_schema()


def test_every_check_offers_its_parameters_and_its_docs():
    definitions = rubric_schema()["$defs"]
    for name, check in CHECKS.items():
        criterion = definitions["Criterion_" + name.replace("-", "_")]
        assert criterion["properties"]["check"]["const"] == name
        assert check.title in criterion["description"]
        assert "with" in criterion["properties"]
        if check.params.model_fields:
            keys = definitions[check.params.__name__]["properties"]
            assert [key for key, about in keys.items() if "description" not in about] == [], name


def test_every_key_says_what_it_means():
    schema = rubric_schema()
    records = {"Rubric": schema, **schema["$defs"]}
    silent = [
        f"{name}.{key}"
        for name, record in records.items()
        for key, about in record.get("properties", {}).items()
        if "description" not in about
    ]
    assert silent == [], "the docstring of a field says what its key means"


def test_a_criterion_for_a_person_is_valid():
    by_check = "    check: rate\n    with:\n      topic: /chatter\n      rate_hz: 10\n"
    assert validator().is_valid(yaml.safe_load(SOUND.replace(by_check, "    check: manual\n")))
    assert not validator().is_valid(
        yaml.safe_load(SOUND.replace("    check: rate\n    with:\n", "    check: manual\n    with:\n"))
    )


@pytest.mark.full
def test_sound_rubrics_are_valid():
    for text in [SOUND, *(loaded.path.read_text(encoding="utf-8") for loaded in all_rubrics())]:
        assert [error.message for error in validator().iter_errors(yaml.safe_load(text))] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("check: rate", "check: rat"),
        ("rate_hz: 10}", "rate_hz: ten}"),
        ("rate_hz: 10}", "rate_hz: 10, x: 1}"),
        (", rate_hz: 10}", "}"),
        ("points: 40", "points: -1"),
        ("title: A sample\n", ""),
        ("id: sample", "id: Sample Lab"),
        ("window_s: 5", "windw_s: 5"),
        ("  real:\n", "  Real Run:\n"),
    ],
)
def test_spoiled_rubrics_are_refused(old, new):
    assert old in SOUND
    assert not validator().is_valid(yaml.safe_load(SOUND.replace(old, new, 1)))
