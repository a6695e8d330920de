"""Many runs: axes, processes, clusters, stores, batches."""
