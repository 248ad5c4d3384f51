"""What computes updates: JAX on any device, or the fused kernel in C++."""
