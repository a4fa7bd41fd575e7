"""Evidence files: what a run did, as MCAP (profile `ros1`), written by the arena and read by everything after it.

In come messages and events, or recordings of other tools (MCAP, ROS 1 bags); out come frozen `run.Run`s, decoded on
demand. What the evidence means for a criterion is not decided here (`checks/`, `judging/`). See docs/design.md.
"""
