"""Pages that run the lander in a browser: its engine as WebAssembly, and JavaScript modules."""
