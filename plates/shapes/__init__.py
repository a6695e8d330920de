"""Outlines of plates and their meshes."""
