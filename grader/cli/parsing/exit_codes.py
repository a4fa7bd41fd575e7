"""What the exit codes of each command mean, as its help says it."""

EXIT_CODES = """exit codes:
  0    passed: the pass mark is reached (by default every visible criterion)
  1    graded, below the pass mark
  2    the command line or a rubric is wrong
  3    could not be graded
  4    inconclusive: a criterion could not be judged
  130  interrupted
"""


CLASS_EXIT_CODES = """exit codes, that of the worst submission:
  0    all passed
  1    all graded, not all passed
  2    the command line, the roster, the rubric or overrides.yaml is wrong
  3    some could not be graded
  4    some are inconclusive, or wait for a person
  130  interrupted: the same command goes on
"""


MUTANTS_EXIT_CODES = """exit codes:
  0    the correct package got everything, and every mutant lost what it must, and no more
  1    it did not, or a mutant was not killed, or a criterion is worth points and costs no mutant anything
  2    the command line, the rubric or the mutants file is wrong
  3    nothing could be graded here
  130  interrupted
"""

REPORT_EXIT_CODES = """exit codes:
  0    written, whatever the result is
  2    the command line or a rubric is wrong
  3    a result cannot be read, or is none that can be shown in this form
  130  interrupted
"""

EXPORT_EXIT_CODES = """exit codes:
  0    written
  2    the command line or the rubric is wrong, or the grader is not installed
  130  interrupted
"""
