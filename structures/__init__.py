"""Ground floor: elastic bodies as linear second-order systems. It knows no other room."""

from structures.kernels import kernel_cache

kernel_cache.provide()
kernel_cache.announce()
