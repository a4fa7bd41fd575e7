"""Submissions of a class that are nearly the same are named for a person to look at. No mark depends on it.

The comparison is `copydetect`'s: code without names and layout, fingerprints of all stretches of 25 signs. What the
starter code, the tutorials and most of the class have is taken out first. Needs the extra `similarity`.
"""

from grader.classes.similarity.comparison import compare, write_similarity

__all__ = ["compare", "write_similarity"]
