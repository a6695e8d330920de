"""What a run writes: frames, the Dataset, checkpoints, the trace of iterations."""
