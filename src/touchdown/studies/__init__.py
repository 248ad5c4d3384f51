"""Many runs: what is varied, over how many seeds, who runs them, and what they say together."""
