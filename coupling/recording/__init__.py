"""The records of a run: frames, the Dataset, checkpoints, the trace of iterations."""
