"""Rubrics: YAML into typed records, with every fault named at once."""
