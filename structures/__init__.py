"""Elastic bodies as linear second-order systems. This package imports none of the others."""
