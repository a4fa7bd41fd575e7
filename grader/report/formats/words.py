"""What the page on formats says beside its tables."""

from __future__ import annotations

INTRODUCTION = """# Formats

What the grader writes and reads, key by key. This page and the schemas are made from the code (`python -m
grader.report.formats.page docs/reference`), and a test holds them to it. `grader schema NAME` prints the schema (JSON
Schema, draft 2020-12) of the grader that is installed; `grader schema` lists them.
"""

POLICY = """## What may change

Each format has a version of its own, a whole number. A grader reads every version that was ever written, and writes
the newest. Files of all times are kept in `fixtures/formats/` and read by the tests.

**A newer version** than a grader knows is refused in one line by whatever reads it, and what is there stays as it is:
`results/ada/result.json: written by a newer grader (grader.result/2); this one reads up to 1`. Update the grader.
(`grader grade` reads no earlier result: it replaces what is in its folder, whoever wrote it.)

**Without a new version** there may come

- in what a grader writes: optional keys, further JSON channels and metadata of evidence. A reader that does not
  know them passes over them, as the grader's own does: no status and no point hangs on them. Where it writes such a
  file again, they are gone. Values of `error.kind` may come too. The schemas leave room for all of it.
- in what people write: keys, checks, and values of keys. An older grader names each as a fault, with file and line:
  there, a key that nobody knows is a slip far more often than something new.

**A new version** is what everything else takes: a key that goes, means something else or has another type, a new
word where a key has one of a fixed set (`status`, say), and everything that would make an older reader take a
status or a point for another than it is.

How a key is written (its order, the indentation, the digits of a number) is no part of a format. The words of
`message`, `hint` and other sentences are for people and change at any time; `id`, `check`, `status` and `kind` are
for programs.

What a command ends with is in the [exit codes](exit-codes.md).
"""

OF_EVIDENCE = """\
MCAP files ([mcap.dev](https://mcap.dev)), profile `ros1`, chunks compressed by zstd with checksums. `package.mcap`
holds what the files say and the build, each `<scenario>.mcap` a run. Any reader of MCAP opens them.

- **What nodes published**: a channel for each topic and publisher, `message_encoding` `ros1`, its schema
  (`ros1msg`) as the publisher sent it, and the channel metadata `topic`, `callerid`, `md5sum`, `latching` (`1` or
  `0`). `log_time` is when the kernel took the message in (ns since 1970), `sequence` counts on the channel from 0.
  `/grader/calibration` (`std_msgs/Header`) is a publisher of the grader's, whose pace is known.
- **What the grader noted**: the JSON channels below, `message_encoding` `json`, each with its JSON Schema in the
  file. All times are their `log_time`.
- **Attachments** of `package.mcap`: the files of the package that were judged.
- **Metadata** `grader.evidence`: what the run was. All values are text.
"""

METADATA = {
    "format": "The version of this format: `1`.",
    "scenario": "The scenario's name in the rubric; `package` for the files and the build.",
    "clock": "`real` or `warped`.",
    "warp": "How many times faster than the wall a warped clock ran.",
    "submission.id": "As in the result.",
    "submission.source": "As in the result.",
    "submission.commit": "As in the result; empty where there is none.",
    "submission.digest": "As in the result.",
    "submission.package": "As in the result.",
    "scenario.digest": "sha256 of the scenario's definition: by another one of the same name, it has to be run again.",
    "grader": "The version of the grader that recorded it.",
    "ros": "The ROS that ran it.",
    "python": "The Python of that ROS.",
    "sandbox": "What shut the student's code in.",
    "limits": "The limits that it ran under, as JSON.",
    "not_run": "Why nothing was run; only there where nothing was.",
    "recording.missing": "Which file was to be handed in and was not there.",
    "recording.problem": "Why the recording that was handed in cannot be read.",
}

CHANNELS = {
    "/grader/package": "What the package's files say (`PackageFacts`): manifest, CMake, scripts, launch files, each "
    "with file and line. Its records are in the schema.",
}
