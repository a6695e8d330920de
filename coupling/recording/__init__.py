"""The records of a run: frames, the Dataset, the trace of iterations."""
