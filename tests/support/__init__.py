"""What tests of several rooms share: evidence built from its text form."""
