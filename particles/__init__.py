"""Beads, their contacts, and the chain that they form. Uses the structures room only."""

from particles import kernel_cache

kernel_cache.provide()
kernel_cache.announce()
