"""Structured input: strategies of hypothesis that give bytes, one a target."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis.strategies import SearchStrategy

from tests.fuzz.grammars import binary, markup, messages, tables, text, wire

GRAMMARS: dict[str, Callable[[], SearchStrategy[bytes]]] = {
    "manifest": markup.manifest,
    "launch": markup.launch,
    "launch-loader": markup.launch_files,
    "cmake": text.cmake,
    "cmake-trace": text.cmake_trace,
    "syntax-report": text.syntax_report,
    "python-causes": text.python_causes,
    "source-file": text.source_file,
    "parameters": text.any_yaml,
    "source": text.source,
    "roster": tables.roster,
    "gitlab": tables.gitlab,
    "template": tables.template,
    "archive": binary.archive,
    "built": binary.built,
    "git-refs": text.git_refs,
    "rubric": text.rubric,
    "mutants": text.mutants,
    "timeline": text.timeline,
    "definition": messages.definition,
    "service": messages.service,
    "frames": wire.frames,
    "mcap": binary.own_mcap,
    "recording": binary.foreign_mcap,
    "bag": binary.bag,
    "header": wire.header,
    "xmlrpc": wire.xmlrpc,
    "service-answer": wire.service_answer,
    "topic-stream": wire.topic_stream,
}
