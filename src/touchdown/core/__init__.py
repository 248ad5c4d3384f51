"""What every part uses: errors, files, seeding, types, threads, the JAX device, progress."""
