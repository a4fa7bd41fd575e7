"""Tables of a class: rosters, what GitLab lists, what learning platforms export."""

from __future__ import annotations

import json

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from tests.fuzz.grammars.common import encoded, joined, words
from tests.fuzz.grammars.text import JSON_VALUES

ROSTER_COLUMNS = (
    "id", "source", "ref", "name", "group", "submitted_at", "extension_days", "Submitted At", "sorce", "Seat",
    "github_username", "student_repository_url", "roster_identifier", "submission_timestamp", "identifier", "github_id",
)  # fmt: skip
ROSTER_FIELDS = (
    "ada", "ADA", "https://git.example/ada.git", "git@h:a/b", "h:x", "../x", "/srv/x", "~root/x", "a@main", "C:\\x",
    "\\\\s\\x", "2026-11-20 23:59", "2026-11-20T23:59:00.5Z", "20/11/2026", "0001-01-01 00:00 +14:00", "1.5", "nan",
    "!!!", "x" * 300, "github.com/x/y", '"a\nb"', '"a', 'a"b', '""', "-x", "a\x0bb\u2028c", "a:b@c:d",
)  # fmt: skip
EXPORT_COLUMNS = (
    "Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Lab 1 (12)", "Lab 1", "Identifier", "Full name",
    '"Lab 1 [Total Pts: 10 Score] |3"', "Email address", "Grade", "Maximum Grade", "First name", "Surname", "Username",
    "Assignment: Lab 1 (Real)", "Last Name", '"Lab 1 [Total Pts: 1.2.3 Score]"', '"Lab ""1"""',
)  # fmt: skip
EXPORT_FIELDS = (
    "ada", '"Lovelace, Ada"', "Ada", "Lovelace", "    Points Possible", "Manual Posting", "100.00", "EX", "N/A", "-",
    "1", "Participant 12", "87,5", '"a\nb"', '"a', 'a"b', '""', ' "x"', "9" * 30,
)  # fmt: skip
PROJECT_KEYS = (
    "path",
    "name",
    "http_url_to_repo",
    "ssh_url_to_repo",
    "namespace",
    "path_with_namespace",
    "id",
)


def roster() -> SearchStrategy[bytes]:
    return _table(
        ROSTER_COLUMNS, ROSTER_FIELDS, first=("id,source", "ID;Source", "sep=;\nid;source", "id\tsource")
    )


def template() -> SearchStrategy[bytes]:
    return _table(
        EXPORT_COLUMNS, EXPORT_FIELDS, first=("Student,ID", "Identifier,Grade", '"Username"\t"Lab 1"')
    )


def gitlab() -> SearchStrategy[bytes]:
    texts = words("ada", "lab/ada", "https://g/ada.git", "/", "//", "a/b/c")
    values = st.one_of(texts, st.fixed_dictionaries({"full_path": texts}), JSON_VALUES)
    project = st.dictionaries(st.sampled_from(PROJECT_KEYS), values, max_size=6)
    page = st.one_of(st.lists(project, max_size=5), st.lists(JSON_VALUES, max_size=2), project).map(
        json.dumps
    )
    return encoded(joined(st.one_of(page, page, words("\n", " ", "][")), most=5))


def _table(
    columns: tuple[str, ...], fields: tuple[str, ...], first: tuple[str, ...]
) -> SearchStrategy[bytes]:
    delimiter = st.sampled_from((",", ",", ";", "\t"))
    header = st.builds("{}{}{}".format, words(*first), delimiter, joined(words(*columns), ",", most=6))
    row = st.builds(lambda cells, sign: sign.join(cells), st.lists(words(*fields), max_size=8), delimiter)
    end = st.sampled_from(("\n", "\r\n", "\r", "\n\n"))
    return encoded(
        st.builds(lambda head, rows, sign: sign.join([head, *rows]), header, st.lists(row, max_size=6), end)
    )
