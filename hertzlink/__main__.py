"""`python -m hertzlink` runs the command `hertzlink`."""

from hertzlink.cli import main

main()
