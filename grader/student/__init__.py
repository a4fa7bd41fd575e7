"""What `grader check` does besides grading: check again at each save, say what git lacks, write out what is staged.

A package's folder comes in; results on a screen and advice go out. Grading itself is the pipeline's business.
"""
