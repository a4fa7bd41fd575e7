"""A worker with another version of the grader."""

import grader

grader.__version__ = "0.0.9"
