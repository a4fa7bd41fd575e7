"""`docs/reference/mutation-operators.md`, made from the operators and the labs' faulty packages."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from grader.authoring.mutation.faulty_packages import load_mutants, mutants_file
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.registry import Operator
from grader.authoring.mutation.solution import find_reference, load_solution
from grader.rubric.load import LoadedRubric, all_rubrics
from scripts.reference.table import prose

EXAMPLE = """\
schema: grader.mutants/1
rubric: my-lab
mutants:
  slow-talker:
    summary: The talker is 8 % too slow.
    edits:
      - {operator: other-rate, at: {script: scripts/talker.py}, with: {factor: 0.92}}
    expect: {chatter-rate: fail}
  talker-not-installed:
    edits:
      - {operator: bit-removed, at: {script: scripts/talker.py}}
      - replace: {file: my_lab/CMakeLists.txt, old: scripts/talker.py, new: ""}
    expect: {cmake-install: fail, talker-executable: fail}
"""
INTRODUCTION = f"""# Mutation operators

`grader rubric test LAB` grades a lab's reference solution, which must get everything, and then mutants of it: packages
with a mistake that students make. A file declares the mutants with the criteria that each must not reach. A mutant is
killed when it loses these, with these statuses, and no others. The labs that come with the grader have their files in
`fixtures/`; for a rubric of your own, the file is `mutants/<id>.yaml` beside it.
`grader rubric test LAB --write FILE` tries every operator and writes what each mutant cost as a first file.

```yaml
{EXAMPLE}```

`edits` change the reference solution, one after the other, by one of the operators below or by hand (`replace`,
`write`, `append`, `mode`, `crlf`, `bom`, `delete`, `link`, `move`; the repository's `fixtures/README.md` says what they
take). `at` says where, if an operator fits in more than one place: any part of the place that tells it from the others
will do (`script`, `topic`, `file`, `node`, `line`, …). `with` are the operator's parameters. `expect` names criteria
with their statuses: `fail`, `partial` or `blocked`.

In the table, a number is how many of the lab's packages use the operator; a dot means that the operator fits the lab's
reference solution and no package uses it. This page is made from the operators and the files of the labs
(`python -m scripts.reference`).
"""
FITS = "·"


@dataclass(frozen=True, kw_only=True)
class Column:
    """One lab: how many packages use each operator, and which operators fit."""

    lab: str
    used: Counter[str]
    fitting: frozenset[str]
    mutants: int


def operators_page() -> str:
    """The whole page as Markdown."""
    columns = [_column(loaded) for loaded in all_rubrics() if mutants_file(loaded) is not None]
    short = [column.lab.split("-", maxsplit=1)[0] for column in columns]
    lines = [
        INTRODUCTION,
        f"| operator | {' | '.join(short)} |",
        f"|---|{'---|' * len(columns)}",
        *(_row(operator, columns) for operator in _operators()),
        _total("packages", [column.mutants for column in columns]),
        _total("operators used", [len(column.used) for column in columns]),
        _total("operators that fit", [len(column.fitting) for column in columns]),
        "",
    ]
    for family in dict.fromkeys(operator.family for operator in _operators()):
        lines += [f"## {family}", ""]
        lines += [_described(o) for o in _operators() if o.family == family]
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _column(loaded: LoadedRubric) -> Column:
    solution = load_solution(find_reference(loaded), loaded.rubric.package)
    path = mutants_file(loaded)
    mutants = load_mutants(path, loaded.rubric).mutants.values() if path is not None else ()
    used = Counter(name for mutant in mutants for name in mutant.operators)
    fitting = frozenset(name for name, operator in OPERATORS.items() if operator.sites(solution))
    return Column(lab=loaded.rubric.id, used=used, fitting=fitting, mutants=len(mutants))


def _operators() -> list[Operator]:
    return sorted(OPERATORS.values(), key=lambda operator: (operator.family, operator.name))


def _row(operator: Operator, columns: list[Column]) -> str:
    name = operator.name
    cells = [str(c.used[name]) if c.used[name] else FITS if name in c.fitting else "" for c in columns]
    return f"| `{name}` | {' | '.join(cells)} |"


def _total(words: str, numbers: list[int]) -> str:
    return f"| **{words}** | {' | '.join(map(str, numbers))} |"


def _described(operator: Operator) -> str:
    fields = operator.params.model_fields.items()
    given = ", ".join(f"`{name}` (default `{field.default!r}`)" for name, field in fields)
    parameters = f" Parameters: {given}." if given else ""
    mistake = operator.mistake[:1].lower() + operator.mistake[1:]
    return prose(f"- `{operator.name}`: the student {mistake}. Fits {operator.fits}.{parameters}")
