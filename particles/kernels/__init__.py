"""Compiled functions of the chain: one file each for contact laws, losses, drives, vibrations, and steps in time.

Arrays of a chain of body 0, the striker, and N beads:
    y, v     N + 1   positions (m) and velocities of the bodies. y is measured from touching, unloaded beads, so the
                     approach of a contact is δᵢ = yᵢ₋₁ − yᵢ, and that of the last one is y_N − w. If bodies vibrate,
                     the amplitudes q (m √kg) of the m modes of each body follow; if contacts yield, their memory
                     follows (see laws.Yielding).
The surface of the structure is at w and moves at a constant rate during a window. A structure behind the chain takes
the place of body 0, which keeps its speed during a window. Contacts 1 … N + 1 have the indices 0 … N; the last one is
that with the structure.
"""
