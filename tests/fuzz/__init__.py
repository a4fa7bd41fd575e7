"""Fuzzing of every parser of foreign data: `README.md` says how."""
