"""Many runs: sweeps over axes, in processes or on clusters, with stores; batches; searches for critical distances."""
