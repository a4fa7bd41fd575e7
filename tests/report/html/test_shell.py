"""Templates are compiled once, and wherever the grader is installed."""

from __future__ import annotations

import sys
from pathlib import Path

from jinja2 import Environment

from grader.report.html.shell import Bytecode, environment


def compiled(folder: Path) -> Environment:
    found = environment().overlay(bytecode_cache=Bytecode(str(folder)), cache_size=0)
    found.get_template("card.html")
    return found


def test_a_template_is_compiled_once(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    compiled(tmp_path)
    assert len([*tmp_path.iterdir()]) == 1
    monkeypatch.setattr(Environment, "_generate", None)
    assert compiled(tmp_path)


def test_nothing_is_written_where_no_bytecode_is_wanted(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert compiled(tmp_path)
    assert [*tmp_path.iterdir()] == []


def test_a_folder_that_cannot_be_written_is_no_hindrance(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    assert compiled(tmp_path / "not there")
