"""Submissions of a class that are nearly the same are named for a person to look at. No mark depends on it.

The library `copydetect` compares fingerprints of every 25 characters of code, without its names and layout. Code of the
starter, of the tutorials, or of most of the class is taken out first. Needs the extra `similarity`.
"""
