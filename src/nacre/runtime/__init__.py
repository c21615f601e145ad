"""What work runs on: threads, devices, compiled kernels, interrupts, progress, saved states."""
