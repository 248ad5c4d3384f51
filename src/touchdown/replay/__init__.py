"""Experience replay: n-step transitions, a ring buffer, and samplers."""
