"""Views of a run: pictures and animations of struck bodies, and files for ParaView."""
