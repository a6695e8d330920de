"""Ground floor: elastic bodies as linear second-order systems. Knows no other room."""
