"""The verbs of the command line as functions, for notebooks and scripts."""
