"""Files: written whole or not at all, plain data without code, HDF5 that stays in its file, locks."""
