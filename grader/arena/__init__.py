"""Runs a submission: workspace, build, sandbox and the managed roscore, seen from the grader's side.

A submission, its package's facts and a rubric's scenarios come in; a recording goes out: one MCAP file for the package
and its build, and one for each scenario. Begin with `recorder`, which builds (`build`) and runs each scenario
(`scenario`) in an arena of its own (`session`, `arena_process`), as many at a time as `admission` lets in. Processes
are described by `process_environment` and walled in by `sandbox`; `ros/` is what runs under ROS's own Python,
`standins/` are packages that the machine may lack. Nothing is judged here.
"""
