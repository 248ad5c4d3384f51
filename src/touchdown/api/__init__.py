"""What the verbs of the command line do, as functions for a notebook."""
