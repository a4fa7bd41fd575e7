"""A rubric and the instructor's files that belong to it, to be taken along."""

from __future__ import annotations

from grader.integrations.deliver.parcel import Parcel
from grader.rubric.instructor import read_instructor
from grader.rubric.load import LoadedRubric
from grader.rubric.source import read_source


def add_lab(parcel: Parcel, rubric: LoadedRubric, folder: str) -> str:
    """Add the rubric's file and those it names below `folder`; gives the rubric's path in the parcel."""
    path = f"{folder}/{rubric.path.name}"
    parcel.add(path, rubric.path.read_bytes())
    source = read_source(rubric.path, rubric.path.name)
    for name, data in read_instructor(source.data, rubric.path.parent).files.items():
        parcel.add(f"{folder}/{name}", data)
    return path
