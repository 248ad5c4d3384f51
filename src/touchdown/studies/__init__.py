"""Studies of many runs: factors, seeds, executors, results and verdicts."""
