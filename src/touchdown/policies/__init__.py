"""What acts: baselines, saved weights, files of other libraries; looked up by name."""
