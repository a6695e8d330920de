"""Compiled functions of the chain: one file for contact laws, losses, drives, vibrations, and steps in time.

Arrays of a chain with N beads behind body 0, the striker:
    y, v     N + 1   positions (m) and velocities of the bodies. y is measured from touching, unloaded beads, so the
                     approach of a contact is δᵢ = yᵢ₋₁ − yᵢ, and that of the last one y_N − w. Behind them lie the
                     amplitudes q (m √kg) of the m modes of each body where bodies vibrate; or the memory
                     of contacts that yield, see laws.Yielding.
The surface of the structure is at w and moves at a constant rate during a window. A structure behind the chain has the
place of body 0, which moves on at the speed that it has as a window starts. Contacts 1 … N + 1 are stored from 0; the
last one is with the structure.
"""
