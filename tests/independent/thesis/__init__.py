"""55 numbers of Khatri's thesis, computed again from its text with numpy and scipy alone.

D. Khatri, Non-Destructive Evaluation of Material System Using Highly Nonlinear Acoustic Waves (Caltech). Nothing
here imports hertzlink or one of its rooms. `values` says what an entry is; theory, geometry, spheres, shapes, rods,
rod_length, layers and plates hold the entries, chapter by chapter; materials, ellipses, line (the discrete chain) and
waves (readings of its forces) are what they share.
"""
