"""Completion in bash, zsh and fish: the script that a shell loads asks this very grader what fits."""
