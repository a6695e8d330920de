"""Tests of a participant of your own: `pytest --pyargs hertzlink.conformance --participant yours:make`.

Without `--participant` the suite checks hertzlink's own participants. `checks` holds the same as functions. Everything
random has a seed.
"""
