"""The folder that a CI system keeps."""

from __future__ import annotations

import pytest

from grader.errors import OutputError
from grader.integrations.ci_systems import clear, keep
from grader.rubric.load import load_rubric


def test_what_an_earlier_run_left_goes_first(tmp_path):
    out = tmp_path / "grader-results"
    (out / "evidence").mkdir(parents=True)
    (out / "evidence" / "talker.mcap").touch()
    (out / "report.html").write_text("100 of 100 points")
    clear(out)
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("name", ["thesis.tex", ".git"])
def test_what_is_not_ours_is_never_removed(tmp_path, name):
    (tmp_path / name).touch()
    (tmp_path / "report.html").touch()
    with pytest.raises(OutputError, match="in the way"):
        clear(tmp_path)
    assert (tmp_path / name).exists()
    assert (tmp_path / "report.html").exists()


def test_a_link_that_was_handed_in_leads_nowhere(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "grader-results").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError):
        clear(tmp_path / "grader-results")
    clear(tmp_path / "elsewhere")
    (tmp_path / "elsewhere" / "evidence").symlink_to("/usr")
    clear(tmp_path / "elsewhere")
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_runs_that_only_hidden_criteria_look_at_are_not_kept(tmp_path):
    lab = load_rubric("leeds-comp3631-lab1").rubric
    hiding = lab.model_copy(
        update={
            "criteria": tuple(
                c.model_copy(update={"visibility": "hidden"}) if c.scenario == "wraps" else c
                for c in lab.criteria
            )
        }
    )
    made, out = tmp_path / "made", tmp_path / "out"
    (made / "evidence").mkdir(parents=True)
    for name in ("package", "talker", "wraps"):
        (made / "evidence" / f"{name}.mcap").touch()
    rows = [
        "== package",
        "   0.1 x stdout: == wraps",
        "== wraps",
        "   0.2 x stdout: secret",
        "== talker",
        "   0.3 x",
    ]
    (made / "console.log").write_text("".join(f"{row}\n" for row in rows))
    clear(out)
    keep(made, out, hiding)
    assert sorted(path.name for path in (out / "evidence").iterdir()) == ["package.mcap", "talker.mcap"]
    assert (out / "console.log").read_text().splitlines() == [rows[0], rows[1], rows[4], rows[5]]
