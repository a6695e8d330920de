"""Case files: a chain, a structure and what to do with them, as TOML; see docs/cases.md.

pint is loaded with the modules of this package, so only by the commands that read cases.
"""
