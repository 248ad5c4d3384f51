"""Shared basics: errors, files, seeding, types, threads, the JAX device, progress."""
