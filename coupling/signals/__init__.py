"""Measured signals: reading files of oscilloscopes and recorders, conditioning, averages of taps, models of sensors."""
