"""`python -m hertzlink` is the command `hertzlink`."""

from hertzlink.cli import main

main()
