"""Shapes of plates and their meshes."""
