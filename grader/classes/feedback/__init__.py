"""What of a class is published, and how it gets to the students.

`publish` freezes results as students may read them; `send` returns them in one of the `forms`, each of which is a
module here. What students read is the report (`report/markdown.py`; a mail has its beginning and `report.html`), with
`Feedback.subject` above it and, after the first time, `changes_between` (`publish.py`). `published.jsonl` and
`sent.jsonl` in the class's folder say what was published and sent, and when.
"""
