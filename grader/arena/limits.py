"""How much one run of a student's code may use and leave behind: memory, processes, output, messages, files.

`ros/process_tree.py` holds a process tree to these limits, by a control group where `control_groups.py` finds room for
one, else `ros/processes.py` watches it and ends it; rlimits come from `sandbox.py`. The recorder limits messages.
"""

from __future__ import annotations

from typing_extensions import Self

from grader.model.record import Record

SUBMISSION_MESSAGE_BYTES = 160 << 20
SUBMISSION_KEPT_BYTES = 20 << 20
LEAST_RUN_BYTES = 8 << 20


class RunLimits(Record):
    """The limits of one run, and of each process tree in it (`rosrun`, `roslaunch`, `catkin_make` and what they start).

    Of one process tree: memory, processes, tasks (threads count), CPU seconds, lines and bytes of output, what its
    sockets' buffers hold, and bytes and files in each of its folders (`home_bytes` counts what it adds to the
    workspace). Of one topic's messages: `channel_messages` and `channel_bytes`. Of the whole run: `run_bytes` and
    `channels` recorded, `kept_bytes` and `kept_files` of the files that it leaves.
    """

    memory_bytes: int = 1 << 30
    processes: int = 200
    tasks: int = 512
    cpu_s: float = 300.0
    output_lines: int = 20_000
    output_bytes: int = 8 << 20
    home_bytes: int = 256 << 20
    home_files: int = 40_000
    tmp_bytes: int = 128 << 20
    tmp_files: int = 10_000
    shared_bytes: int = 64 << 20
    shared_files: int = 1_000
    locked_bytes: int = 1 << 20
    queued_signals: int = 1024
    file_bytes: int = 64 << 20
    open_files: int = 1024
    descriptors: int = 8192
    socket_bytes: int = 128 << 20
    address_space_bytes: int = 8 << 30
    built_bytes: int = 96 << 20
    channel_messages: int = 20_000
    channel_bytes: int = 64 << 20
    run_bytes: int = 64 << 20
    channels: int = 300
    kept_bytes: int = 16 << 20
    kept_files: int = 10

    def shared_by(self, runs: int, *, keeping: int = 0) -> Self:
        """Return the limits of each of so many runs of one submission, of which some keep files: together they record
        no more than one may."""
        run_bytes = max(LEAST_RUN_BYTES, min(self.run_bytes, SUBMISSION_MESSAGE_BYTES // max(1, runs)))
        return self.model_copy(
            update={
                "run_bytes": run_bytes,
                "channel_bytes": min(self.channel_bytes, run_bytes),
                "kept_bytes": min(self.kept_bytes, SUBMISSION_KEPT_BYTES // max(1, keeping)),
            }
        )
