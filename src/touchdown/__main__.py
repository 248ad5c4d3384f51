"""`python -m touchdown` is the command line."""

from touchdown.cli.app import main

main()
