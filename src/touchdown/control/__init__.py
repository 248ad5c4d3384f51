"""Classical control: the paper's PID controller, and Twiddle, which tunes it."""
