"""The evidence file: one MCAP a run, profile `ros1` (docs/design.md, Evidence)."""
