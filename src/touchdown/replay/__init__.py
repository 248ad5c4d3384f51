"""Experience replay: n-step transitions, a ring that stores them, and samplers that draw them."""
