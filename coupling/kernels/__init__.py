"""The compiled window loop: chains and linear structures agree on the forces of each window; results are recorded."""
