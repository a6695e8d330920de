"""The compiled window loop: chains and linear structures agree on the forces of each window, which is then recorded."""
