"""Ground floor: elastic bodies as linear second-order systems. It knows no other room."""
