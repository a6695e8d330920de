"""Reports: what was computed, from what, and how far to trust it, on one HTML page that needs no network."""
