"""Rubrics: a YAML file and an instructor's own checks in, typed records out, with every fault named at once.

Running scenarios and judging them is not its business."""
